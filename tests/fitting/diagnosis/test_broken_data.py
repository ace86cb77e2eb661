"""A diagnosis names no effect on data whose runs do not belong together."""

import numpy as np
import pytest
from diagnosis_contract import check
from rich.console import Console

from fitting import diagnose
from fitting.blind.protocol._exchange import to_recording
from fitting.blind.simulator._bank import Spec
from fitting.diagnosis._data_checks import find_inconsistencies
from fitting.identification._posed import Posed
from fitting.recording_check._check import check_recording
from fitting.report.diagnosis._terminal import render_lines
from rapi_jax import RAPI
from rapi_jax.effects import Creep, Drift, Etalon, RateLaw
from rapi_jax.internal import float64
from tests.support.spoiled import WAYS, healthy


@float64
def found(columns, *, explained=False):
    recording = columns.recording()
    return find_inconsistencies(recording, RAPI.guess(recording), explained=explained)


@pytest.mark.parametrize(
    ("way", "kind"),
    [
        ("columns swapped", "columns swapped"),
        ("one run times 1.02", "run does not belong"),
        ("two devices, 5 % apart", "run does not belong"),
        ("response of another run", "copied readings"),
        ("responses in another order", "exchanged runs"),
        ("noisy drive", "noisy drive"),
    ],
)
def test_what_is_wrong_is_found_before_any_effect(way, kind):
    columns = healthy(71)
    WAYS[way](columns)
    assert {fault.kind for fault in found(columns)} == {kind}


@pytest.mark.parametrize(
    ("way", "judged"),
    [
        ("a square drive", False),
        ("noisy drive", False),
        ("columns swapped", False),
        ("clipped at 5 %", True),
    ],
)
def test_what_check_says_of_a_diagnosis_is_what_it_does(way, judged):
    columns = healthy(74)
    WAYS[way](columns)
    (question,) = (q for q in check_recording(columns.recording()).questions if "effect" in q.name)
    assert (found(columns) == []) is judged and (question.answer != "no") is judged


def test_runs_explained_to_noise_are_not_fitted_once_more(monkeypatch):
    """Readings copied from a run of an equal drive are explained as well, and found still."""
    monkeypatch.setattr(Posed, "of", lambda *_, **__: pytest.fail("fitted once more"))
    assert found(healthy(75), explained=True) == []
    columns = healthy(76)
    WAYS["response of another run"](columns)
    assert {fault.kind for fault in found(columns, explained=True)} == {"copied readings"}


@pytest.mark.parametrize("way", ["a lag of 1 ms not stated", "drift of 10 GHz", "clipped softly"])
def test_effects_are_left_to_the_diagnosis(way):
    columns = healthy(72)
    WAYS[way](columns)
    assert found(columns) == []


def test_the_verdict_blames_the_data():
    columns = healthy(73)
    WAYS["bias wrong in half of the runs"](columns)
    diagnosis = diagnose(None, columns.recording(), scan=False)
    assert diagnosis.verdict.name == "unlisted" and diagnosis.verdict.effects == ()
    assert "The recording has a fault" in diagnosis.verdict.sentence
    assert "0.3" in diagnosis.verdict.sentence
    content = diagnosis.to_dict()
    assert content["faults"][0]["kind"] == "run does not belong"
    assert sum(h["probability"] for h in content["hypotheses"]) == pytest.approx(1.0)
    assert all(h["name"] in ("none", "unlisted") for h in content["hypotheses"])


def test_probabilities_say_as_little_of_the_device_as_the_sentence():
    """Neither that something is missing nor that nothing is; no scan is chosen from such data."""
    columns = healthy(74)
    WAYS["one run times 10"](columns)
    content = check(diagnose(None, columns.recording()))
    assert "the device was not judged" in content["verdict"]["sentence"]
    assert not content["verdict"]["judged"]
    assert {h["name"]: h["probability"] for h in content["hypotheses"]} == {
        "unlisted": 0.5,
        "none": 0.5,
    }
    assert content["verdict"]["set"] == ["unlisted", "none"]
    assert content["next_scan"] is None


def test_a_square_drive_is_told_once_and_no_hypotheses_are_listed():
    columns = healthy(77)
    WAYS["a square drive"](columns)
    content = check(diagnose(None, columns.recording()))
    kinds = [fault["kind"] for fault in content["faults"]]
    assert kinds.count("switched drive") == 1 and not content["verdict"]["judged"]
    with (console := Console(width=200)).capture() as shown:
        console.print(render_lines(content))
    assert "switches between two levels" in shown.get() and "Hypotheses" not in shown.get()


def test_what_differs_at_the_only_run_of_a_rate_may_be_the_device():
    """A rate written wrong and another law with rate look alike there: the latter is considered."""
    columns = healthy(75)
    columns.time[3] = columns.time[3] * 1.25
    columns.rates[3] /= 1.25
    content = check(diagnose(None, columns.recording(), candidates=[RateLaw, Etalon], scan=False))
    assert content["verdict"]["judged"]
    assert {"rate_law", "unlisted"} & set(content["verdict"]["set"])
    (fault,) = [f for f in content["faults"] if f["kind"] == "differs with rate"]
    assert "wrong clock or rate" in fault["message"] and fault["run"] == "run03"
    assert any("differs with rate" in note for note in content["notes"])


@pytest.mark.parametrize(("row", "offset"), [(0, 5.0), (0, 0.3), (3, -0.3)])
def test_an_origin_set_anew_is_no_drift(row, offset):
    """Readings of a first or last run that lie apart may be a drift, which moves within runs too.

    Noise is 20 MHz; without the check the smallest was called drift, at 0.88.
    """
    columns = healthy(74)
    columns.response[row] = columns.response[row] + offset
    diagnosis = diagnose(None, columns.recording(), candidates=[Drift, Creep], scan=False)
    assert (
        not diagnosis.verdict.judged and "the device was not judged" in diagnosis.verdict.sentence
    )
    assert f"run0{row}" in diagnosis.verdict.sentence
    assert diagnosis.content["faults"][0]["kind"] == "differs with time"


@pytest.mark.parametrize("amplitude", [-1.0, 0.6])
def test_a_drift_that_an_offset_of_the_first_run_nearly_explains_is_named(amplitude):
    """Over before the second run, 10 s later; of the first run's own 0.3 s it shows a tenth."""
    columns = healthy(74)
    for row, time in enumerate(columns.time):
        columns.response[row] = columns.response[row] + amplitude * np.exp(-(10 * row + time) / 3.0)
    recording = columns.recording()
    assert {f.kind for f in found(columns)} == {"differs with time"}
    diagnosis = diagnose(None, recording, candidates=[Drift, Creep], scan=False)
    assert diagnosis.verdict.name == "drift" and diagnosis.verdict.judged
    assert diagnosis.verdict.probability > 0.9


@pytest.mark.slow
def test_a_drift_that_wanders_is_named_though_its_runs_lie_apart():
    """A simulated random walk of twice the noise: runs with origins of their own leave more."""
    device = Spec(1005, "form", "drift", 2.0, base_misfit=False).draw()
    diagnosis = diagnose(None, to_recording(device.runs), candidates=[Drift, Creep], scan=False)
    assert {"differs with time"} == {fault["kind"] for fault in diagnosis.content["faults"]}
    assert diagnosis.verdict.name == "drift" and diagnosis.verdict.judged
