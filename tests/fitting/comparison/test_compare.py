"""What changed between two recordings: found, named, with its size; and what is refused."""

import dataclasses
import html
import json
import re

import numpy as np
import pytest
from device_pairs import changed_device, record
from scipy import stats
from worlds import drives

from fitting import compare
from fitting.comparison._differences import Interval
from rapi_jax import DataError, predict
from rapi_jax.examples import paper_device, paper_drives
from rapi_jax.internal import typeset

CHANGES = {"alpha": 1.03, "zeta": 1.1, "lam": 1.02, "eta": 1.05, "a": 1.02, "b": 1.1, "d_1": 1.005}


@pytest.fixture(scope="module")
def session():
    return drives()


@pytest.fixture(scope="module")
def before(session):
    return record(session, 1)


@pytest.fixture(scope="module")
def wider(session, before):
    return compare(before, record(session, 2, alpha=1.05, origin=3.0), ecdl=paper_device())


def test_nothing_changed_between_two_sessions_of_one_device(session, before):
    found = compare(before, record(session, 2, origin=-2.0), ecdl=paper_device())
    assert not found.changed and found.trusted and found.probabilities["none"] > 0.5
    least = f"{1e3 * found.detectable_response:.3g} MHz rms would have been found in 95 % of cases"
    assert found.headline.startswith("Nothing changed that these recordings show: ")
    assert found.headline.endswith(f"{least}.") and len(found.headline) < 200
    assert found.response.low == 0.0 and found.response.high < 0.1 * 0.02
    assert found.gap.change.low < 0.0 < found.gap.change.high
    assert "d_0" not in {p.name for p in found.parameters}


def test_a_changed_parameter_is_named_with_its_size(wider, session):
    assert wider.changed and wider.set == ("alpha",) and wider.probabilities["alpha"] > 0.95
    moved, value = wider["alpha"], float(paper_device().operator.alpha)
    assert moved.change.low <= 0.05 * value <= moved.change.high
    assert moved.difference.low <= 0.05 * value <= moved.difference.high
    assert "width of the hysteresis loop" in wider.headline and "+5.00 %" in wider.headline
    assert "+5.0 %" in wider.details[0]  # two digits, as in the table


def test_the_headline_is_one_sentence_with_what_changed_and_its_interval(wider):
    """In per cent; what is explained in brackets, the p-value and the drives stand below it."""
    found = re.fullmatch(
        r"The width of the hysteresis loop \(`alpha`\) changed by "
        r"\+(\S+) % \(\+(\S+) to \+(\S+)\)\.",
        wider.headline,
    )
    value, low, high = map(float, found.groups())
    assert low <= 5.0 <= high and low < value < high < low + 1.0
    assert wider.summary().startswith(f"{wider.headline}\n{wider.details[0][:60]}")
    assert wider.sentence == " ".join((wider.headline, *wider.details))
    untrusted = dataclasses.replace(wider, trusted=False).headline
    assert untrusted.endswith(" (not to be relied on: see the notes).")


@pytest.mark.slow
def test_a_change_of_the_detectable_size_is_found(session, wider):
    """Of eight pairs at least seven, where 95 % are promised."""
    change = wider["alpha"].detectable / float(paper_device().operator.alpha)
    assert 0.0005 < change < 0.01
    found = [
        compare(record(session, k), record(session, k + 50, alpha=1 + change), ecdl=paper_device())
        for k in range(10, 18)
    ]
    assert sum(one.changed for one in found) >= 7


def test_a_change_that_cannot_be_told_apart_names_what_it_may_be(wider):
    found = dataclasses.replace(wider, set=("alpha", "a", "several")).headline
    assert found.startswith("One of `alpha` and `a` changed, perhaps others with it, which these")
    assert "the response changed by " in found and found.count(".") <= 4


def test_the_change_of_the_response_is_that_of_the_devices(wider, session):
    """And the gap of the device as it was is that change, since nothing else is wrong with it."""
    one, two = (
        np.concatenate([np.asarray(predict(device, drive)) for drive in session])
        for device in (paper_device(), changed_device(alpha=1.05))
    )
    truth = float(np.std(two - one))
    assert wider.response.low <= truth <= wider.response.high
    assert wider.response.high < 1.05 * truth
    assert wider.gap.after.low <= truth <= wider.gap.after.high
    joint, alone = (wider.recordings[1][key] for key in ("rmse_joint", "rmse"))
    assert joint > 1.3 * alone


def test_the_joint_model_lies_between_the_two(wider):
    joint, moved = wider.model["joint"]["alpha"], wider["alpha"]
    assert moved.before < joint < moved.after


def test_files_page_and_text(wider, tmp_path):
    written = wider.save(tmp_path, names=("monday <b>", "friday"))
    assert {p.name for p in written} == {"comparison.json", "report.html"}
    said = json.loads((tmp_path / "comparison.json").read_text(), parse_constant=pytest.fail)
    assert said["schema"] == "rapi.comparison/1" and said["changed"] is True
    row = said["parameters"]["alpha"]
    assert row["difference"]["low"] < row["difference"]["value"] < row["difference"]["high"]
    assert row["unit"] == "1" and row["percent"] == pytest.approx(5.0, abs=2.0)
    page = (tmp_path / "report.html").read_text()
    assert "monday &lt;b&gt;" in page and "<script" not in page
    heading = page.partition("<h1")[2].partition("</h1>")[0].partition(">")[2]
    assert heading.replace("\u00a0", " ") == html.escape(wider.headline.replace("`", ""))
    text = re.sub("<[^>]*>", "", page)
    assert all(html.escape(typeset(x).replace("`", "")) in text for x in wider.details)
    assert said["headline"] == wider.headline and said["details"] == list(wider.details)
    assert "`" not in page and "p = &lt;" not in page and "If one parameter alone changed" in page
    assert (
        "alpha" in wider.summary()
        and repr(wider) == f"<Comparison: changed, p = {wider.p_change:.2g}>"
    )


def test_of_many_changes_the_sentence_names_three(wider):
    sizes = np.linspace(-1.03, 1.6, len(wider.parameters))
    moved = tuple(
        dataclasses.replace(
            p, before=1.0, before_stderr=0.01, difference=Interval(size, 0.9 * size, 1.1 * size)
        )
        for p, size in zip(wider.parameters, sizes, strict=True)
    )
    moved = tuple(dataclasses.replace(p, p_holm=1e-13, difference_stderr=0.1) for p in moved)
    several = dataclasses.replace(wider, parameters=moved, set=("several",))
    text, count = several.sentence, len(moved)
    assert text.startswith("Several parameters changed: the response changed by ")
    assert len(text) < 450 and len(several.headline) < 100
    assert f"{count} of {count} changed, most surely " in text and text.count("`") == 6
    assert "+160 %" in text and "−100 %" in text and "e+" not in text
    assert all(old not in text for old in (" -", "(-"))
    most = max(wider.response_by_drive, key=lambda one: one["rms"])
    where = f"{most['excitation_hz']:g} Hz with {most['amplitude']:g} V peak to peak"
    assert f" rms, most at {where} ({1e3 * most['rms']:.3g} MHz)" in text


def test_what_a_model_lacks_in_both_is_not_said_to_be_new(wider):
    def left(before, after):
        at = [Interval(size, 0.9 * size, 1.1 * size) for size in (before, after)]
        misfit = dataclasses.replace(wider.gap, before=at[0], after=at[1], p_value=3.4e-8)
        return dataclasses.replace(wider, misfit=misfit, misfit_changed=True)

    both = left(0.129, 0.131)
    assert "lacks something in both recordings" in both.sentence and "p = 3.4e-08" in both.sentence
    assert both.headline.startswith("What the model lacks in both recordings changed: ")
    assert "came up" not in both.sentence and wider.details[0] in both.details
    assert "129 MHz (116 to 142) rms before and 131 MHz (118 to 144) after" in both.headline
    assert "lacks came up between the recordings" in left(0.01, 0.131).headline
    assert "lacks went away between the recordings" in left(0.131, 0.01).headline


def test_a_bound_of_the_response_is_told_as_one(wider):
    found = dataclasses.replace(wider, response=Interval(0.0, 0.0, 0.398))
    assert "the response differs by at most 398 MHz rms." in found.sentence


def test_the_response_by_drive_adds_up_to_all(wider):
    squares = [one["rms"] ** 2 for one in wider.response_by_drive]
    assert {one["excitation_hz"] for one in wider.response_by_drive} == {10.0, 20.0, 40.0}
    assert np.sqrt(np.mean(squares)) == pytest.approx(wider.response.value, rel=0.05)


def test_two_changes_are_not_blamed_on_one(session, before):
    found = compare(before, record(session, 3, lam=1.02, d_1=1.01), ecdl=paper_device())
    assert found.changed and found.set == ("several",)
    assert {"lam", "d_1"} <= {p.name for p in found.parameters if p.p_holm < 0.05}
    assert found.sentence.startswith("Several parameters changed")


def test_sessions_of_other_rates_have_no_change_where_there_is_none(session, before):
    """One rate alone leaves a long curved valley, along which a fit of its own ends far away."""
    few = [d for d in session if d.rate == 20.0]
    found = compare(before, record(few, 4), ecdl=paper_device())
    assert not found.changed
    assert any("scan rates differ" in note for note in found.notes)


def shifted(recording, volts):
    runs = [
        dataclasses.replace(r, drive=dataclasses.replace(r.drive, value=r.drive.value + volts))
        for r in recording.runs
    ]
    return dataclasses.replace(recording, runs=tuple(runs))


def test_what_cannot_be_compared_is_refused(session, before):
    after = record(session, 2)
    with pytest.raises(DataError, match="`response_unit` is GHz before and MHz after.*Convert"):
        compare(before, dataclasses.replace(after, response_unit="MHz"))
    with pytest.raises(DataError, match="`drive_unit` is V before and um after"):
        compare(before, dataclasses.replace(after, drive_unit="um"))
    with pytest.raises(DataError, match="from 1.5 to 4.5 V before and from 101.5.*no common range"):
        compare(before, shifted(after, 100.0))
    with pytest.raises(DataError, match="hold the same data"):
        compare(before, before)
    with pytest.raises(TypeError, match="Argument `after` must be a Recording"):
        compare(before, "after")
    with pytest.raises(TypeError, match="Argument `ecdl` must be an ECDL"):
        compare(before, after, ecdl=paper_device().operator)


SESSIONS = {
    "one sweep a rate": (lambda: paper_drives(samples=500), 0.0),
    "four periods": (drives, 0.0),
    "coloured noise": (drives, 0.6),
    "one rate, then all": (drives, 0.0),
}
NULLS = 60


@pytest.mark.calibration
@pytest.mark.parametrize("name", SESSIONS)
def test_how_often_a_change_is_said_where_there_is_none(name):
    """About 5 % of pairs, and 95 % intervals that hold the truth; the p-values are uniform."""
    make, memory = SESSIONS[name]
    session = make()
    first = [d for d in session if d.rate == 20.0] if name.startswith("one rate") else session
    found = [
        compare(
            record(first, 2 * k + 100, memory=memory),
            record(session, 2 * k + 101, memory=memory),
            ecdl=paper_device(),
        )
        for k in range(NULLS)
    ]
    changed = sum(one.changed for one in found)
    print(f"{name}: changed said in {changed} of {NULLS}")
    assert stats.binomtest(changed, NULLS, 0.05, "greater").pvalue > 0.01, changed
    if first is session:  # of one rate alone some differences are not seen: p is then larger
        assert stats.kstest([one.p_value for one in found], "uniform").pvalue > 1e-3
    held = [
        np.mean([p.difference.low <= 0.0 <= p.difference.high for p in one.parameters])
        for one in found
    ]
    # Parameters of one pair err together: chance is that between pairs, 0.5 % on one side.
    assert stats.ttest_1samp(held, 0.95, alternative="less").pvalue > 0.005, np.mean(held)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(n, marks=pytest.mark.slow if n in ("lam", "b") else pytest.mark.calibration)
        for n in CHANGES
    ],
)
def test_each_parameter_that_changed_is_found(name):
    session, factor = drives(), CHANGES[name]
    found = [
        compare(
            record(session, 2 * k + 500), record(session, 2 * k + 501, **{name: factor}),
            ecdl=paper_device(),
        )
        for k in range(8)
    ]  # fmt: skip
    operator = paper_device().operator
    value = float(operator.d[0]) if name == "d_1" else float(getattr(operator, name))
    truth = (factor - 1.0) * value
    assert all(one.changed for one in found)
    assert sum(one.set == (name,) for one in found) >= 7
    assert sum(one[name].change.low <= truth <= one[name].change.high for one in found) >= 6


def test_a_parameter_that_cannot_be_told_from_the_others_is_held():
    """One swing, and thresholds that do not grow with the rate: any opening fits with some scale.

    Its standard error is then thousands of times its value, where no model is linear any more.
    """
    session = drives(rates=(10.0, 30.0), amplitudes=(4.5,), periods=3)
    pair = [record(session, seed, zeta=0.0) for seed in (1, 2)]
    found = compare(*pair, ecdl=changed_device(zeta=0.0))
    assert not found.changed
    assert any("cannot be told from the other parameters" in note for note in found.notes)
    assert all(np.isfinite([p.change.low, p.change.high]).all() for p in found.parameters)
