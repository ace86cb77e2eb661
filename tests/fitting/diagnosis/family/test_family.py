"""The law of the thresholds: chosen before effects are blamed, and not in place of one."""

import functools

import jax.numpy as jnp
import numpy as np
import pytest
from diagnosis_contract import check
from threshold_devices import classical, record, session

from fitting import diagnose
from fitting.blind.protocol._exchange import to_recording
from fitting.blind.protocol._tiers import bank_entries
from fitting.diagnosis.base_misfit._columns import _runs
from fitting.diagnosis.family._choice import FamilyChoice
from fitting.diagnosis.family._law import threshold_law
from fitting.diagnosis.noise._periods import decimate
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from rapi_jax import ECDL, PI, RAPI, FixedRAPI, MixedRAPI
from rapi_jax.effects import AmplifierLowpass, AmplitudeLaw, Etalon
from rapi_jax.examples import paper_device
from rapi_jax.io import read_model

PAPER = paper_device().operator
SHAPE = dict(zeta=1e-3, lam=1.2, eta=1.0, a=0.6, b=0.2, d=(15.0, -0.4))
MIXED = MixedRAPI(alpha=0.15, rho=0.5, **SHAPE, plays=12)
TWO = session(rates=(10.0, 40.0))
THREE = session(rates=(10.0, 40.0), amplitudes=(1.5, 3.0, 4.5))


def law(**fields):
    return AmplitudeLaw(**fields, reference=3.0, centre=3.0)


DEVICES = {  # (operator, effects, drives), and the law that the base should have
    "the paper's": ((PAPER, (), TWO), RAPI),
    "classical": ((classical(), (), TWO), FixedRAPI),
    "classical, low-pass": ((classical(), (AmplifierLowpass(tau=8e-5),), TWO), FixedRAPI),
    "classical, three amplitudes": ((classical(), (), THREE), FixedRAPI),
    "mixed": ((MIXED, (), THREE), MixedRAPI),
    # Not to be absorbed:
    "gain and threshold": ((PAPER, (law(threshold=0.2, gain=0.02),), TWO), RAPI),
    "thresholds fall behind": ((PAPER, (law(threshold=-0.3),), TWO), RAPI),
    "they fall behind, three": ((PAPER, (law(threshold=-0.3),), THREE), RAPI),
    "both, three": ((PAPER, (law(threshold=-0.3, gain=0.02),), THREE), RAPI),
    "low-pass": ((PAPER, (AmplifierLowpass(tau=2e-4),), TWO), RAPI),
    "etalon": ((PAPER, (Etalon(amplitude=0.2, spacing=9.0),), TWO), RAPI),
}


@functools.cache
def recording_of(name):
    operator, effects, drives = DEVICES[name][0]
    return record(operator, *effects, drives=drives)


SLOW = {"classical, three amplitudes", "mixed", "they fall behind, three", "both, three", "etalon"}


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=pytest.mark.slow if n in SLOW else ()) for n in DEVICES]
)
def test_the_base_has_the_devices_law(name):
    recording, expected = recording_of(name), DEVICES[name][1]
    fitted = fit_base(WhitenedModel.of(decimate(recording)), None)
    assert type(fitted.operator) is expected
    assert fitted.family.operator is expected
    assert fitted.family.differs == (expected is not RAPI)


@pytest.mark.parametrize(
    ("chosen", "fixed", "likelier"),
    [(RAPI, -80.0, "FixedRAPI"), (RAPI, -95.0, None), (FixedRAPI, -80.0, None)],
)
def test_a_law_of_more_evidence_that_was_not_taken_is_known(chosen, fixed, likelier):
    """By odds that are decisive: 10 in the natural logarithm."""
    choice = FamilyChoice(chosen, {"RAPI": -100.0, "FixedRAPI": fixed})
    assert choice.likelier == likelier


def test_without_a_gap_no_other_law_is_tried_and_with_one_amplitude_none_can_be():
    fitted = fit_base(WhitenedModel.of(recording_of("the paper's")), None)
    assert set(fitted.family.log_evidence) == {"RAPI"}
    one = record(classical(), drives=session(rates=(10.0, 40.0), amplitudes=(4.0,)))
    assert fit_base(WhitenedModel.of(one), None).family is None
    other = ECDL(FixedRAPI.guess(recording_of("mixed")))
    fitted = fit_base(WhitenedModel.of(recording_of("mixed")), other)
    assert fitted.family is None and type(fitted.operator) is FixedRAPI


def test_the_law_in_words():
    words = {
        "thresholds fixed in V": (FixedRAPI(rho=0.5, **SHAPE), classical()),
        "thresholds that grow with the swing": (PAPER,),
        "thresholds that grow slower than the swing": (MIXED,),
        "no thresholds": (PI(r=[0.0], p=[1.0], d=[1.0]),),
    }
    for expected, operators in words.items():
        assert {threshold_law(operator, 4.0, "V") for operator in operators} == {expected}


def test_the_density_of_plays_follows_the_operators_law():
    """Its widest threshold at rate 0 in each run is the operator's, times one factor for all."""
    swing, rate = np.array([1.0, 2.0, 4.0]), np.array([10.0, 40.0, 10.0])
    for operator in (FixedRAPI(rho=0.8, **SHAPE), MIXED, PAPER):
        found = _runs(operator, swing, rate, 24)
        own = [float(operator.plays(jnp.asarray(u), jnp.asarray(0.0)).r.max()) for u in swing]
        still = [float((r - part).max()) for r, part, *_ in found]
        ratio = np.array(still) / own
        np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)


# --- whole diagnoses


@pytest.mark.slow
def test_the_law_is_found_beside_an_effect_that_is_larger_than_a_wrong_one():
    """A simulated Preisach actuator: the low-pass leaves more than either law of thresholds does.

    So the paper's law is taken at first, and an amplitude law beside the low-pass explains what the
    thresholds fixed in volts do, until these are fitted beside the low-pass.
    """
    (entry,) = (e for e in bank_entries("hysteresis", 7, 104) if e.name.endswith("-119236545"))
    device = entry.spec.draw()
    recording = to_recording(device.runs)
    alone = fit_base(WhitenedModel.of(decimate(recording)), None)
    assert type(alone.operator) is RAPI
    found = diagnose(None, recording, scan=False)
    assert found.verdict.name == "amplifier_lowpass" == device.truth[0]
    tau = device.parameters["amplifier_lowpass"]["tau"]
    assert float(found.model.effects[0].tau) == pytest.approx(tau, rel=0.1)
    assert any("fixed in V" in note for note in found.notes)


@pytest.fixture(scope="module")
def plain():
    return diagnose(None, record(classical()), scan=False)


@pytest.mark.slow
def test_a_classical_piezo_without_an_effect_has_none(plain, tmp_path):
    out = check(plain)
    assert out["verdict"]["name"] == "none" and out["verdict"]["set"] == ["none"]
    assert out["base"]["family"] == "thresholds fixed in V"
    assert out["base"]["operator"] == "FixedRAPI"
    evidence = out["base"]["log_evidence"]
    assert evidence["FixedRAPI"] > evidence["RAPI"] + 1e5
    assert any("rapi fit RECORDING -o result --operator FixedRAPI" in note for note in out["notes"])
    plain.save(tmp_path)
    operator = read_model(tmp_path / "model.rapi")[0].operator
    assert threshold_law(operator, 4.0, "V") == "thresholds fixed in V"


@pytest.mark.slow
def test_a_classical_piezo_behind_a_lowpass_has_that_alone():
    recording = record(classical(), AmplifierLowpass(tau=8e-5))
    out = check(diagnose(None, recording, scan=False))
    assert "amplifier_lowpass" in out["verdict"]["set"]
    assert out["verdict"]["effects"] == ["amplifier_lowpass"]
    found = {h["name"]: h for h in out["hypotheses"]}["amplifier_lowpass"]["parameters"]["tau"]
    assert found["value"] == pytest.approx(8e-5, rel=0.1)


@pytest.mark.slow
def test_a_model_brought_whose_law_loses_is_told_so():
    recording = record(classical(), drives=TWO)
    brought = ECDL(RAPI.guess(recording))
    out = check(diagnose(brought, recording, candidates=(AmplitudeLaw,), scan=False))
    (note,) = [n for n in out["notes"] if "than the given model does" in n]
    assert note.startswith("thresholds fixed in V describe") and "--operator FixedRAPI" in note
    assert out["verdict"]["name"] == "none" and out["gap"]["parametric"] > 0.1


@pytest.mark.slow
def test_an_amplitude_law_on_the_papers_device_is_still_named():
    recording = record(PAPER, law(threshold=0.2, gain=0.02))
    out = check(diagnose(None, recording, scan=False))
    assert out["verdict"]["set"] == ["amplitude_law"]
    assert out["base"]["family"] == "thresholds that grow with the swing"
