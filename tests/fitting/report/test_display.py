"""Results that show themselves: text, HTML with everything escaped, tables, pictures."""

import dataclasses
import re
from html.parser import HTMLParser
from types import SimpleNamespace

import numpy as np
import pytest
from parsed_page import Page

from fitting.identification._fit import fit
from fitting.identification.assessment._ends import Start
from fitting.report._plain_text import plain_text
from fitting.report.diagnosis._numbers import unit_text
from fitting.report.fit._page import render_page
from fitting.report.fit._rows import describe_together
from fitting.report.fit._table import (
    _tabulate_starts,
    fold_notes,
    fold_runs,
    parameter_remark,
    render_brief,
    render_verdict,
    round_with_error,
)
from rapi_jax import (
    ECDL,
    RAPI,
    Identified,
    Recording,
    Run,
    certify,
    compensate,
    linear_scan,
    plot,
    predict,
    triangle,
)
from rapi_jax.display._summary import Summary
from rapi_jax.effects import Etalon
from rapi_jax.examples import paper_device
from rapi_jax.internal import quantity, significant
from rapi_jax.ranging.budget import Budget, BudgetLine
from rapi_jax.readout._readout import Peaks, Readout


@pytest.fixture(scope="module")
def recording() -> Recording:
    rng = np.random.default_rng(0)
    runs = []
    for i, drive in enumerate(
        triangle([10.0, 40.0], amplitude=4.5, bias=3.0, samples=600, periods=3)
    ):
        response = np.asarray(predict(paper_device(), drive)) + 0.02 * rng.normal(size=drive.size)
        runs.append(Run(drive, response, f"run<{i}>"))
    return Recording(tuple(runs), provenance={"recorded_at": "2026-11-24T10:00:00Z"})


@pytest.fixture(scope="module")
def result(recording):
    start = ECDL(RAPI.guess(recording, plays=3))
    return fit(start, recording, starts=1, hold_out=False, throw=False)


class Checked(HTMLParser):
    """Raises where a tag is left open or is none that a summary writes."""

    def __init__(self, text: str):
        super().__init__()
        self.open: list[str] = []
        self.feed(text)
        assert not self.open

    def handle_starttag(self, tag, attrs):
        assert tag in "div p strong table thead tbody tr th td ul li".split(), tag
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def budget() -> Budget:
    return Budget((BudgetLine("air", 1e-6, "<b>"), BudgetLine("cavity", 3e-6)))


def reading() -> Readout:
    time = np.linspace(0.0, 0.1, 50)
    peaks = Peaks(*(np.zeros(2) for _ in range(4)))
    error = np.full(50, 2e-5)
    return Readout(time, 75.0 * time, error, (), peaks, 1.7e-8, 1e-12, 0.1, ("clipped & doubtful",))


def shown(recording) -> dict:
    device = ECDL(paper_device().operator, (Etalon.at(amplitude=0.05, spacing=7.0),))
    (target,) = linear_scan(20.0, span=60.0)
    made = compensate(paper_device(), target, identified=Identified.of(recording))
    certificate = certify(paper_device().operator, 0.5, 5.5, u_pp=5.0, freq=20.0)
    return {
        "recording": (recording, ("run<1>", "40", "GHz", "2026-11-24")),
        "model": (device, ("RAPI with 10 plays and Etalon", "alpha", "Etalon.spacing")),
        "certificate": (certificate, ("The model can be inverted between 0.5 and 5.5", "20 Hz")),
        "compensation": (made, ("Drive for a scan of 60 GHz at 20 Hz", "exact", "can be inverted")),
        "readout": (reading(), ("50 times", "20 kHz", "17 ns", "clipped & doubtful")),
        "budget": (budget(), ("3.16 um", "air", "<b>")),
    }


def test_each_result_has_a_summary_and_html_that_is_escaped(recording):
    for name, (value, words) in shown(recording).items():
        text, html = value.summary(), value._repr_html_()
        for word in words:
            assert word in text, (name, word)
        assert "run<0" not in html and "<b>" not in html and "clipped & " not in html
        Checked(html)


def test_tables_and_arrays(recording, result):
    frame = recording.to_dataframe()
    assert list(frame.run.unique()) == ["run<0>", "run<1>"] and len(frame) == 1200
    shorter = dataclasses.replace(
        recording.runs[0].drive, time=np.arange(9.0), value=np.arange(9.0)
    )
    uneven = Recording((recording.runs[0], Run(shorter, np.ones(9), "short")))
    data = uneven.to_dataset()
    assert data.response.shape == (2, 600) and int(data.response[1].notnull().sum()) == 9
    assert data.response.attrs["units"] == "GHz" and data.excitation_hz.attrs["units"] == "Hz"
    table = result.to_dataframe()
    assert table.loc["alpha", "low"] < table.loc["alpha", "value"] < table.loc["alpha", "high"]
    fitted = result.to_dataset()
    left = (fitted.response - fitted.predicted).where(fitted.used == 1)
    assert float(left.std()) == pytest.approx(result.rmse, rel=0.01)
    assert reading().to_dataset().frequency.attrs["units"] == "GHz"


def test_pictures_of_a_fit(result):
    for name in ("loops", "residuals", "spectrum", "correlation", "starts"):
        figure = getattr(result.plot, name)()
        assert figure._repr_png_().startswith(b"\x89PNG")
        for axis in figure.axes:
            assert axis.get_xlabel() or axis.get_ylabel()
    own = plot.Picture()
    axis = own.subplots()
    assert result.plot.residuals(run=1, ax=axis) is own and "40 Hz" in axis.get_title()
    assert plot.svg(own) == plot.svg(own) and b"<svg" in plot.svg(own)


def test_the_page_of_a_fit_is_one_small_file_without_a_script(result):
    text = render_page(result)
    page = Page(text)
    assert len(text) < 1_000_000 and not page.scripts
    pictures = [dict(attrs)["src"] for tag, attrs in page.tags if tag == "img"]
    assert len(pictures) == 4 and all(x.startswith("data:image/png;base64,") for x in pictures)
    first = next(words for tag, words in page.texts if tag == "h1")
    assert first.startswith("The model is NOT to be trusted")  # one start alone
    for reason in result.verdict.reasons:
        assert " ".join(reason.split()) in page.text
    assert "run<0" not in text and "alpha" in page.text
    assert "`" not in page.text  # commands within sentences are shown as code


def test_a_page_of_lengths_has_proper_letters_and_one_unit_for_errors(result):
    lengths = dataclasses.replace(result.recording, response_unit="um")
    notes = ("range: play 1 from -1.32e+03 to -2.37e-07 V, slope -3.5e-02 um/V at 4 V.",)
    verdict = dataclasses.replace(result.verdict, notes=notes)
    page = render_page(dataclasses.replace(result, recording=lengths, verdict=verdict))
    shown = re.sub(r"<code>.*?</code>|[\w+/=]{200,}", "", page.partition("</style>")[2])
    assert not re.search(r"\bu[mVs]\b|\^|\de[-+]\d", shown)
    assert not re.search(r"\d (?:V|um|μm|nm|Hz|%)(?!\w)", shown)
    assert "from −1320 to 0\N{NO-BREAK SPACE}V, slope −0.035\N{NO-BREAK SPACE}μm/V" in shown
    errors = set(re.findall(r"\d\N{NO-BREAK SPACE}([pnμ]m)(?![\w/])", shown))
    assert errors == {"nm"}


def test_reasons_that_several_runs_have_are_counted_and_shown_once(result):
    reasons = tuple(f"jump: run 'r{k}': a jump of {k + 1} nm. Cut it." for k in range(8))
    verdict = dataclasses.replace(result.verdict, trusted=False, reasons=reasons)
    found = dataclasses.replace(result, verdict=verdict)
    page, brief = Page(render_page(found)).text, plain_text(render_brief(found))
    for text in (" ".join(brief.split()), page):
        assert "NOT to be trusted, for this reason" in text and text.count("a jump of") == 1
        assert "The same in r1, r2, r3, r4, r5, r6, r7." in text


def test_units_that_read_well():
    assert quantity(0.0427, "GHz") == "42.7 MHz" and quantity(3.2, "GHz") == "3.2 GHz"
    assert quantity(2e-5, "V") == "20 uV" and quantity(0.0, "GHz") == "0 GHz"
    empty = Summary("Nothing")
    assert empty.text() == "Nothing" and "<table>" not in empty.html()


def test_notes_are_folded_and_said_once():
    rest = "of play 1 is 0, not positive: that play has no hysteresis there."
    notes = (
        f"run 'a': threshold {rest}",
        "one rate: a lag. Record more.",
        f"run 'b': threshold {rest}",
    )
    first, second = fold_runs(notes)
    assert first == f"run 'a': threshold {rest} (2 runs are alike.)" and second == notes[1]
    folded = fold_notes({"monday": notes[1:2], "tuesday": notes[1:2], "friday": ()})
    assert folded == ["2 of 3 recordings: one rate: a lag."]


def test_numbers_below_a_million_have_no_power_of_ten():
    assert quantity(3.6e-4, "GHz") == "360 kHz"
    assert [significant(x, 2) for x in (364.0, 36.4, 0.0364, 123456.0)] == [
        "360",
        "36",
        "0.036",
        "120000",
    ]
    assert significant(2.5e7, 2) == "2.5e+07"


def ended(number: int, end: str, excess: float) -> Start:
    """A start that ended so much above the lowest cost, 1."""
    cost = 1.0 + excess
    return Start(f"guess {number}", 10 + number, cost, True, True, ((0, cost),), end, excess)


def test_many_starts_are_told_by_kind_and_few_each(result):
    ends = [ended(0, "lowest cost", 0.0)]
    ends += [ended(k, "nearly the same response", 1e-2 * k) for k in range(1, 9)]
    ends += [ended(9, "another optimum", 4.0)]
    many = plain_text(_tabulate_starts(dataclasses.replace(result, starts=tuple(ends))))
    assert "guess 1 and 7 more" in many and "11 to 18" in many
    assert "nearly the same response, cost up to 8 % higher" in many
    assert "guess 9 " in many and "another optimum, cost 5 times as high" in many
    few = plain_text(_tabulate_starts(dataclasses.replace(result, starts=tuple(ends[:4]))))
    assert all(f"guess {k} " in few for k in range(4)) and "more" not in few


def test_a_gap_is_said_beside_trust(result):
    verdict = dataclasses.replace(result.verdict, reasons=(), trusted=True, with_gap=True)
    said = render_verdict(dataclasses.replace(result, verdict=verdict)).plain
    assert said.startswith("The model can be trusted, though its residual of ") and " rms" in said
    without = dataclasses.replace(verdict, with_gap=False)
    assert "gap" not in render_verdict(dataclasses.replace(result, verdict=without)).plain


def test_what_a_person_reads_first_is_short_and_the_rest_is_on_the_page(result):
    brief, page = plain_text(render_brief(result)), Page(render_page(result))
    assert "NOT to be trusted" in brief and "alpha" in brief and "2 runs: rmse " in brief
    assert all(head not in brief for head in ("Starts", "weight", "rho"))
    assert len(brief.splitlines()) < 30 < len(result.summary().splitlines())
    for words in ("weight", "rho", "Starts of the solver", "lowest cost", result.describe_starts()):
        assert words in page.text


def test_parameters_that_are_known_only_together_are_named_beside_trust(result):
    names = [p.name for p in result.parameters if not p.held]
    places = [result.names.index(name) for name in names]
    matrix = np.eye(len(result.names))
    apart = dataclasses.replace(result, correlation=matrix)
    assert describe_together(apart) == ""
    matrix = matrix.copy()
    for (i, j), r in zip([places[:2], places[1:3]], (-0.99, 0.96), strict=True):
        matrix[i, j] = matrix[j, i] = r
    said = describe_together(dataclasses.replace(result, correlation=matrix))
    first, second = f"{names[0]} and {names[1]} (-0.990)", f"{names[1]} and {names[2]} (+0.960)"
    assert f"{first}, {second}. Their combination is known better" in said


@pytest.mark.parametrize(
    ("value", "stderr", "held", "at_bound", "remark"),
    [
        (0.377, 23.0, False, False, "error exceeds value"),
        (0.377, 0.02, False, False, ""),
        (0.377, np.inf, False, False, ""),  # `not determined` stands in the place of its error
        (0.377, 23.0, True, False, "held"),
        (0.0, 23.0, False, True, "at a bound"),
    ],
)
def test_a_parameter_whose_error_exceeds_it_is_remarked(value, stderr, held, at_bound, remark):
    found = SimpleNamespace(value=value, stderr=stderr, held=held, at_bound=at_bound)
    assert parameter_remark(found) == remark


def test_what_rounds_to_zero_has_no_sign():
    assert round_with_error(-0.3, 96.0) == ("0", "96")
    assert round_with_error(-0.3, 0.02) == ("-0.300", "0.020")


def test_powers_of_units_are_raised():
    assert unit_text("GHz/V^2") == "GHz/V\N{SUPERSCRIPT TWO}"
    assert unit_text("um") == "\N{GREEK SMALL LETTER MU}m" and unit_text("GHz") == "GHz"
