"""The page of a diagnosis as a parser reads it: order, words, escaping, nothing from outside."""

import copy
import json
import math
import re
from typing import Any

import diagnoses
import pytest
from parsed_page import Page, spaced

from fitting.report.diagnosis._how_far import tabulate_shrinkage
from fitting.report.diagnosis._numbers import (
    Scale,
    format_number,
)
from fitting.report.diagnosis._page import render_page
from fitting.report.diagnosis._summary import list_facts, list_provenance
from fitting.report.diagnosis._terminal import render_text
from fitting.report.diagnosis._text import describe_hypothesis, packaged_labels

SECTIONS = ["verdict", "where", "which", "how-far", "next", "sure"]


@pytest.mark.parametrize(
    ("operator", "which"), [("RAPI", "the same"), ("GeneralRAPI", "a more flexible")]
)
def test_what_the_closed_share_counts_from_is_said_beside_the_residual(operator, which):
    """437 mV of the model as fitted and 57.8 mV held out are of two models."""
    found = diagnoses.creep()
    found["base"] = {"operator": "RAPI"}
    found["model"] = found["model"] | {"operator": operator}
    said = f"is of held-out data: there {which} hysteresis without the effect"
    for text in (
        render_text(found),
        spaced(" ".join(t for _, t in Page(render_page(found)).texts)),
    ):
        assert said in " ".join(text.split())
    for name in ("none", "unlisted"):
        without = copy.deepcopy(found)
        without["verdict"]["name"] = name
        assert "is of held-out data" not in render_text(without)


@pytest.fixture(params=diagnoses.ALL, scope="module")
def parsed(request) -> tuple[str, dict[str, Any], str, Page]:
    """Each hand-written diagnosis: its name, itself, the page, the page parsed."""
    diagnosis = json.loads(json.dumps(diagnoses.ALL[request.param]()))
    text = render_page(diagnosis)
    return request.param, diagnosis, text, Page(text)


def test_verdict_is_first_and_sections_are_in_order(parsed):
    _, diagnosis, _, read = parsed
    tag, first = read.texts[0]
    assert tag == "h1"
    said = diagnosis["verdict"].get("sentence")
    assert first == spaced(said) + "." * (not said.endswith(".")) if said else first.endswith(".")
    assert [text for tag, text in read.texts[1:3]][0] == "Next."
    ids = [attributes.get("id") for _, attributes in read.tags]
    assert [name for name in ids if name in SECTIONS] == SECTIONS
    assert [t for tag, t in read.texts if tag == "h2"] == [
        *(["The effect in the data"] if diagnosis.get("signature") else []),
        "Where the gap lies",
        "Which effect it is",
        "How far the gap closes",
        "The next scan",
        "How sure this is",
    ]


def test_nothing_leaves_the_page(parsed):
    _, _, text, read = parsed
    assert len(text.encode()) < 1_000_000
    for tag, attributes in read.tags:
        assert not any(name.startswith("on") for name in attributes), (tag, attributes)
        assert tag != "script"
        for name in ("src", "href", "srcset", "action", "data", "poster"):
            assert name not in attributes or attributes[name] == "data:,", (tag, attributes)
    style = text[text.index("<style>") : text.index("</style>")]
    assert "url(" not in style and "@import" not in style
    policy = next(a["content"] for a in read.all("meta") if "http-equiv" in a)
    assert policy is not None and policy.startswith("default-src 'none'")


def test_every_figure_has_words_and_a_table(parsed):
    _, diagnosis, _, read = parsed
    plots = [a for a in read.all("div") if (a.get("class") or "") == "plot"]
    assert bool(plots) == bool(diagnosis.get("maps"))
    for plot in plots:
        assert plot["role"] == "img" and len(plot["aria-label"] or "") > 40
    if plots:
        assert len({p["id"] for p in plots}) == len(plots)
        assert len(read.all("details")) >= 5
    assert len(read.all("figcaption")) == len(read.all("figure"))


def test_every_number_of_the_maps_is_in_a_table():
    diagnosis = diagnoses.creep()
    read = Page(render_page(diagnosis))
    cells = {text for tag, text in read.texts if tag == "td"}
    for row in diagnosis["maps"]["phase"]["rows"]:
        for value in row["mean"]:
            assert value is None or format_number(1e3 * value, sign=True) in cells
    for row in diagnosis["maps"]["harmonics"]["rows"]:
        assert all(format_number(1e3 * value) in cells for value in row["amplitude"])


def test_the_signature_stands_under_the_verdict_with_all_its_numbers():
    diagnosis = diagnoses.creep()
    page = render_page(diagnosis)
    places = [
        page.index(f"<{part}") for part in ("h1", 'section id="signature"', 'section id="where"')
    ]
    assert places == sorted(places)
    read = Page(page)
    assert "18.2 MHz rms without it, and 0.9 MHz with it".replace(" ", "") in (
        read.text.replace("\N{NO-BREAK SPACE}", "").replace(" ", "").replace("0.900", "0.9")
    )
    cells = {text for tag, text in read.texts if tag == "td"}
    for row in diagnosis["signature"][0]["rows"]:
        for key in ("without", "with"):
            for value in row[key]:
                assert value is None or format_number(1e3 * value, sign=True) in cells
    assert "The effect in the data" not in Page(render_page(diagnoses.none())).text


def test_without_a_signature_the_residual_itself_stands_under_the_verdict():
    diagnosis = diagnoses.unlisted() | {"maps": diagnoses.creep()["maps"]}
    page = render_page(diagnosis)
    heads = [text for tag, text in Page(page).texts if tag in ("h2", "h3")]
    assert heads[:2] == ["The residual in the data", "Over phase and rate"]


def test_the_map_over_the_axis_of_the_effect_comes_first():
    for axis, title in (("response", "Over optical frequency"), ("session", "Over the session")):
        diagnosis = diagnoses.creep()
        diagnosis["signature"][0]["axis"] = axis
        heads = [text for tag, text in Page(render_page(diagnosis)).texts if tag == "h3"]
        assert heads[2] == title


@pytest.mark.parametrize(
    ("axis", "unit", "quantity", "size"),
    [
        ("response", "GHz", "optical frequency", "18.2 MHz"),
        ("drive", "V", "drive", "18.2 MHz"),
        ("session", "s", "time in the session", "18.2 MHz"),
        ("gain", "s", "time in the session", "1.82 %"),
        ("phase", "1", "phase of the period", "18.2 MHz"),
    ],
)
def test_the_signature_says_over_what_it_is(axis, unit, quantity, size):
    diagnosis = diagnoses.creep()
    diagnosis["signature"][0] |= {"axis": axis, "unit": unit}
    text = Page(render_page(diagnosis)).text.replace("\N{NO-BREAK SPACE}", " ")
    assert f"Over the {quantity} the mean residual is {size} rms without it" in text


def test_hostile_text_stays_text():
    tame, wild = Page(render_page(diagnoses.look_alikes())), Page(render_page(diagnoses.hostile()))
    assert not wild.all("script")
    assert not wild.all("b") or all(not attributes for attributes in wild.all("b"))
    assert spaced(diagnoses.HOSTILE) in wild.text
    # Labels in a chart are as text as any other.
    assert not {tag for tag, _ in wild.tags} - {tag for tag, _ in tame.tags}


def test_what_the_likeliest_effect_closes_is_the_same_in_the_headline_and_beside_it():
    """An unlisted verdict that mentions it: no page then says that no effect closes anything."""
    found = diagnoses.unlisted()
    found["verdict"]["set"] = ["unlisted", "resonance"]
    found["shrinkage"] |= {"closed_fraction": None, "after": 0.4}
    (resonance,) = [h for h in found["hypotheses"] if h["name"] == "resonance"]
    resonance["closed_fraction"] = diagnoses.fraction(0.86, 0.69, 0.94)
    text = Page(render_page(found)).text
    assert "86 % (69 to 94 %) by the likeliest known effect, which is not added" in text
    assert "No known effect is named, so none is added." in text
    assert "What remains." not in text  # nothing was taken away
    found["verdict"]["set"] = ["unlisted"]
    assert "not by any known effect" in Page(render_page(found)).text


def test_what_the_verdicts_say():
    text = {name: Page(render_page(make())).text for name, make in diagnoses.ALL.items()}
    assert "closes 94 % of it on data it has not seen" in text["creep"]
    assert "Use the model with creep, model.rapi" in text["creep"]
    assert "no effect is missing (probability 96 %)" in text["none"]
    assert "no gap above the noise" in text["none"] and "no gap" not in text["one_period"]
    assert "none of the known effects explains it (probability 96 %)" in text["unlisted"]
    # The best of them is no answer, and a gap that is not explained is still one.
    assert "no gap" not in text["unlisted"] and "too little to name that effect" in text["unlisted"]
    assert (
        "cannot decide which it is: a delay between drive and reading, or a low-pass"
        in text["look_alikes"]
    )
    assert (
        "Record one more scan (triangle, 100 Hz, 1 V peak to peak, bias 3 V)" in text["look_alikes"]
    )
    assert "97 % together" in text["look_alikes"]
    assert "not to be trusted" in text["one_period"]
    assert "The noise floor is not known" in text["one_period"]
    assert (
        "400 MHz rms, on held-out data" in text["unlisted"] and "24.7 → 10.8 MHz" in text["creep"]
    )
    assert "24.7 → 10.8 nm" in text["displacement"] and "2, 3 μm" in text["displacement"]
    assert "Over optical frequency" in text["creep"]
    assert "Over optical frequency" not in text["displacement"]


@pytest.mark.parametrize("name", ["creep", "none", "unlisted"])
def test_nothing_is_said_of_held_out_data_where_nothing_was_held_out(name):
    """The gap is then told once, as it was recorded."""
    diagnosis = diagnoses.ALL[name]()
    total = diagnosis["gap"]["total"]
    diagnosis["shrinkage"] |= {
        "before": total, "after": total, "closed_fraction": None, "held_out": [], "by_part": [],
    }  # fmt: skip
    found = tabulate_shrinkage(diagnosis["shrinkage"], Scale.of("GHz", [total]), name)
    assert found is not None and "held-out" not in found["shows"]
    assert [bar["key"] for bar in found["bars"]] == ["before", "floor"]
    facts = dict(list_facts(diagnosis, Scale.of("GHz", [total]), {}))
    assert "held-out" not in facts["Residual"] and "→" not in facts["Residual"]


def test_a_gap_that_more_plays_explain_is_not_called_noise():
    """Of classical plays a fit leaves five times the noise, and no effect does it."""
    found = diagnoses.ALL["none"]()
    found["gap"]["total"] = found["shrinkage"]["before"] = 5.0 * found["shrinkage"]["floor"]
    found["shrinkage"] |= {"after": None, "held_out": [], "by_part": []}
    left = 1.1 * found["shrinkage"]["floor"]
    found["base"] = {"operator": "RAPI", "richer": {"plays": 24, "rms": left}}
    scale = Scale.of("GHz", [left])
    page = spaced(Page(render_page(found)).text)
    assert f"with 24 plays, in the model of this diagnosis, {spaced(scale(left))} rms" in page
    assert "There is no gap to close" not in page and "no gap above the noise" not in page
    assert "by no effect: it is hysteresis of another shape" in page


def test_a_pair_of_which_one_holds_an_and_is_read_once():
    pair = describe_hypothesis("delay+pickup", packaged_labels())
    assert pair == (
        "a delay between drive and reading together with pickup at a fixed frequency in time"
    )
    assert describe_hypothesis("creep+etalon", packaged_labels()).count(" and ") == 1


def test_commands_in_notes_are_code_on_the_page():
    found = diagnoses.creep()
    found["notes"] = ["`rapi fit --operator FixedRAPI` judges it."]
    page = render_page(found)
    assert "`" not in Page(page).text and "judges it." in Page(page).text


def test_what_lies_below_noise_is_called_nothing():
    diagnosis = diagnoses.creep()
    diagnosis["gap"] |= {"locked": 0.0213, "not_locked": -0.001}
    text = Page(render_page(diagnosis)).text
    assert (
        "the part that repeats with the scan is 21.3 MHz rms and the part that does not is zero"
        in text
    )


def test_hypotheses_are_ranked_and_the_set_is_marked():
    read = Page(render_page(diagnoses.look_alikes()))
    marks = [attributes.get("class") for attributes in read.all("li")][:3]
    assert marks == ["inside", "inside", None]
    names = [text for tag, text in read.texts if tag == "code"]
    assert names == ["delay", "amplifier_lowpass", "none"]


def test_budget_shares_are_squares():
    gap = diagnoses.creep()["gap"]
    parts = [gap[key] ** 2 for key in ("structural", "parametric", "noise_floor")]
    widths = re.findall(
        r'<i class="[a-z-]+" style="width:([\d.]+)%"></i>', render_page(diagnoses.creep())
    )
    total = max(sum(parts), gap["total"] ** 2)
    assert [float(w) for w in widths[:3]] == pytest.approx(
        [100 * p / total for p in parts], abs=6e-3
    )


def paths(node: Any, at: tuple = ()) -> list[tuple]:
    """Every key that may be missing, lists entered at their first element."""
    if isinstance(node, list):
        return paths(node[0], (*at, 0)) if node else []
    if not isinstance(node, dict):
        return []
    return [p for key in node for p in ((*at, key), *paths(node[key], (*at, key)))]


def brief(node: Any) -> Any:
    """The same diagnosis with two of everything."""
    if isinstance(node, dict):
        return {key: brief(value) for key, value in node.items()}
    return [brief(item) for item in node[:2]] if isinstance(node, list) else node


def without(diagnosis: dict, path: tuple, null: bool) -> dict:
    node: Any = diagnosis
    for key in path[:-1]:
        node = node[key]
    if null:
        node[path[-1]] = None
    else:
        del node[path[-1]]
    return diagnosis


@pytest.mark.parametrize("null", [True, False])
def test_any_key_may_be_missing_or_null(null):
    kept = {("schema",), ("verdict",)}
    for path in paths(brief(diagnoses.look_alikes())):
        if path not in kept:
            read = Page(render_page(without(brief(diagnoses.look_alikes()), path, null)))
            assert read.texts[0][0] == "h1", path
            # A missing value as Python writes it, not "None of the known effects".
            assert not re.search(r"None(?! of the known)", read.text), path
            assert "nan" not in read.text.lower().split(), path


def test_numbers_that_are_not_finite_are_shown_as_missing():
    diagnosis = diagnoses.creep()
    diagnosis["gap"]["noise_floor"] = math.nan
    diagnosis["maps"]["phase"]["rows"][1]["mean"][3] = math.inf
    assert "The noise floor is not known" in Page(render_page(diagnosis)).text


@pytest.mark.parametrize("change", [{"schema": "rapi.diagnosis/2"}, {"verdict": None}])
def test_another_file_is_refused(change):
    with pytest.raises(ValueError, match=r"diagnosis\.json"):
        render_page(diagnoses.creep() | change)


def luminance(colour: str) -> float:
    """Relative luminance of `#rrggbb` by WCAG 2."""
    parts = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


@pytest.mark.parametrize("scheme", [0, 1], ids=["light", "dark"])
def test_contrast(scheme):
    style = render_page(diagnoses.none()).partition("<style>")[2].partition("</style>")[0]
    colours = dict(
        re.findall(r"(--\w+): (#[0-9a-f]{6})", style.split("prefers-color-scheme")[scheme])
    )

    def contrast(name: str, ground: str = "--ground") -> float:
        pair = sorted(luminance(colours[key]) + 0.05 for key in (name, ground))
        return pair[1] / pair[0]

    for name in ("--ink", "--soft"):  # text, on the page and on washes
        assert contrast(name) >= 4.5 and contrast(name, "--wash") >= 4.5
    for name in ("--accent", "--dot", *(f"--s{i}" for i in range(6))):  # lines and marks
        assert contrast(name) >= 3.0, name


def test_a_page_of_a_hundred_runs_is_below_a_megabyte():
    diagnosis = diagnoses.creep()
    for key in ("phase", "frequency", "harmonics"):
        rows = diagnosis["maps"][key]["rows"]
        diagnosis["maps"][key]["rows"] = [
            row | {"run": row["run"] + 8 * k} for k in range(12) for row in rows
        ]
    assert len(render_page(diagnosis).encode()) < 1_000_000


def test_a_device_that_was_not_judged_is_not_said_to_lack_an_effect():
    diagnosis = diagnoses.unlisted()
    diagnosis["verdict"]["judged"] = False
    diagnosis["shrinkage"]["closed_fraction"] = None
    text = Page(render_page(diagnosis)).text
    assert "Gap closed not judged" in text and "known effect reduces" not in text


@pytest.mark.parametrize(
    ("recorded", "said"),
    [(35_006, "14 006, thinned from 35 006"), (14_006, "14 006"), (None, "14 006")],
)
def test_thinned_samples_are_said_to_be_thinned(recorded, said):
    found = diagnoses.creep()
    about = found["recording"] | {"samples": 14_006, "samples_recorded": recorded}
    facts = dict(list_provenance(found | {"recording": about}, "V"))
    assert " ".join(facts["Samples"].split()) == said
