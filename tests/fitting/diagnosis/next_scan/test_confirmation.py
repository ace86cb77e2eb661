"""The scan for one answer beside `unlisted`: inside what was recorded, and said as what it is."""

import json

import pytest
from edge_worlds import drives, record

from fitting.diagnosis._text import verdict_advice
from fitting.diagnosis.next_scan._confirmation import confirmation_scan, needs_confirmation
from fitting.diagnosis.next_scan._proposal import propose_next_scan
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._forward_selection import without_effects
from fitting.diagnosis.which.evidence._evidence import Evidence
from fitting.report.diagnosis._how_far import describe_next_scan
from rapi_jax import DriveLimits, Identified
from rapi_jax.effects import Creep


@pytest.fixture(scope="module")
def whitened():
    return WhitenedModel.of(record(drives((10.0, 40.0), amplitudes=(2.0, 3.0))))


@pytest.mark.parametrize(
    ("names", "alone"),
    [
        (["creep", "unlisted"], True), (["unlisted", "none"], True), (["creep"], False),
        (["unlisted"], False), (["creep", "delay"], False),
        (["creep", "unlisted", "delay"], False),
    ],
)  # fmt: skip
def test_one_answer_beside_unlisted(names, alone):
    assert needs_confirmation(names) is alone


@pytest.mark.parametrize("name", ["none", "creep", "unlisted"])
def test_where_one_answer_stands_alone_no_scan_is_proposed(whitened, name):
    fitted = fit_base(whitened, None)
    likely = without_effects(fitted.refit, fitted.state, fitted.eta_fixed[1])
    ranked = [(None, 0.97), (likely, 0.02), (likely, 0.01)]
    evidence = Evidence(1, 0, True, ())
    assert propose_next_scan(whitened, fitted, ranked, evidence, [name], None) is None


def test_the_scan_lies_inside_what_was_recorded(whitened):
    found = confirmation_scan(whitened, ["unlisted", "creep+etalon"])
    assert found is not None and found.waveform == "sine"
    assert found.excitation_hz == 20.0  # the geometric middle of 10 and 40 Hz
    assert found.amplitude == pytest.approx(0.8 * 3.0) and found.bias == pytest.approx(3.0)
    low, high = found.drive.value.min(), found.drive.value.max()
    assert 1.5 < low < high < 4.5
    assert found.drive.periods == 3 and found.drive.size == 3 * 200
    assert found.drive.start_s >= whitened.recording.drives[-1].session_time[-1] + 60.0
    Identified.of(whitened.recording).recorded_limits().check(found.drive)
    other = "an effect other than creep of the piezo and an etalon in the light path is missing"
    assert other in found.reason
    assert "an effect is missing" in confirmation_scan(whitened, ["none", "unlisted"]).reason
    written = json.loads(json.dumps(found.to_dict(), allow_nan=False))
    assert {"waveform", "excitation_hz", "amplitude", "bias", "separates"} <= written.keys()
    assert (
        describe_next_scan(written, "V", {})["table"] is None
    )  # there is nothing to compare it with


def test_limits_that_forbid_it_are_kept(whitened):
    assert confirmation_scan(whitened, ["creep", "unlisted"], DriveLimits(1.0, 5.0, 1e-6)) is None


def test_the_scan_comes_before_the_cure():
    said = verdict_advice("creep", (Creep,), ["creep"], {"waveform": "sine"}, unsure=True)
    assert said.startswith("First record the next scan given below") and "run in" in said
    assert "next scan" not in verdict_advice("creep", (Creep,), ["creep"], None, unsure=True)
    assert "next scan" not in verdict_advice("creep", (Creep,), ["creep"], {"waveform": "sine"})
