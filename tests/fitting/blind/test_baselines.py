"""Baselines on small recordings with a strong known effect."""

import numpy as np
import pytest
from worlds import TRUTHS, recorded

from fitting.blind.prediction._baselines import baseline_verdicts
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which.screening._base_remainder import BaseRemainder
from fitting.diagnosis.which.screening._screen import screen_effect
from rapi_jax.effects import AmplifierLowpass, CurrentCoupling, Etalon, Pickup, Resonance

FEW = (AmplifierLowpass, CurrentCoupling, Etalon, Pickup, Resonance)
ANSWERS = {"none", "unlisted", *(cls.name for cls in FEW)}


@pytest.fixture(scope="module")
def strong():
    """A resonance far above the noise."""
    return recorded((TRUTHS["resonance"],), noise=0.01)


@pytest.fixture(scope="module")
def fitted(strong):
    return fit_base(WhitenedModel.of(strong), None)


@pytest.mark.slow
def test_each_answers_and_a_strong_effect_is_named(strong, fitted):
    found = baseline_verdicts(strong, FEW, seed=3, fitted=fitted)
    assert list(found) == ["correlation", "jacobian", "aic", "lowpass", "random"]
    assert found["jacobian"] == "resonance"
    assert "resonance" in found["aic"].split("+")
    assert len(found["aic"].split("+")) <= 3
    assert found["correlation"] in ANSWERS - {"none", "unlisted"}
    assert found["lowpass"] == "amplifier_lowpass"
    assert found == baseline_verdicts(strong, FEW, seed=3, fitted=fitted)


@pytest.mark.slow
def test_an_effect_left_out_is_never_named(strong, fitted):
    few = tuple(cls for cls in FEW if cls is not Resonance)
    for seed in range(2):
        found = baseline_verdicts(strong, few, seed=seed, fitted=fitted)
        assert "resonance" not in "+".join(found.values())


def test_the_fall_along_a_signature_is_its_correlation(fitted):
    refit, state = fitted.refit, fitted.state
    left = np.concatenate([state.errors.synchronous, state.errors.nonsynchronous])
    nothing = np.zeros((state.errors.synchronous.size, 0))
    beyond = BaseRemainder.beyond_tangent(state, nothing)
    for trial in (TRUTHS["resonance"], TRUTHS["amplifier_lowpass"]):
        (found,) = screen_effect(refit, state, [trial], nothing, beyond) or [None]
        moved = refit.evaluate(state.values, (trial,)).errors
        signature = np.concatenate([moved.synchronous, moved.nonsynchronous]) - left
        rho = -(signature @ left) / np.sqrt((signature @ signature) * (left @ left))
        share = found.score / (state.synchronous + state.nonsynchronous)
        assert share == pytest.approx(max(rho, 0.0) ** 2, rel=1e-6)


def test_the_random_answer_is_any_of_all():
    """Without candidates there is nothing to search, and two answers are left."""
    recording = recorded((), noise=0.02)
    base = fit_base(WhitenedModel.of(recording), None)
    drawn = [baseline_verdicts(recording, (), seed=seed, fitted=base) for seed in range(30)]
    assert {found["random"] for found in drawn} == {"none", "unlisted"}
    assert {(d["correlation"], d["jacobian"], d["aic"]) for d in drawn} == {("none",) * 3}
