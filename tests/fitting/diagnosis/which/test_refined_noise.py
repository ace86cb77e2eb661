"""Noise is read again where effects explain what had counted as noise."""

import numpy as np
import pytest
from edge_worlds import NOISE, drives, record

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import FittedBase, fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._refined_noise import with_refined_noise
from rapi_jax import Recording
from rapi_jax.effects import AbstractEffect, Drift, Etalon, ModeHop

SESSION = drives((10.0, 25.0), periods=8)
DRIFT = Drift.at(amplitude=3.0, tau=1.0)
HOP = ModeHop.at(size=1.0, threshold=70.0, width=1.0, settle_s=1e-9)
ETALON = Etalon.at(amplitude=0.3, spacing=7.0)


def best_of(fitted: FittedBase, *effects: AbstractEffect) -> Candidate:
    """The refit with these effects from their true values."""
    refit = fitted.refit
    end = refit.minimise(refit.evaluate(fitted.state.values, effects), 60)
    return Candidate(effects, end, refit, end, refit, end, 1.0)


def fitted_and_best(recording: Recording, *effects: AbstractEffect) -> tuple[FittedBase, Candidate]:
    fitted = fit_base(WhitenedModel.of(recording), None)
    return fitted, best_of(fitted, *effects)


def test_jumps_that_drift_had_moved_are_no_noise():
    """Their instants differ from period to period, and what they do was taken for noise.

    Beside too much noise a reading may stay on the wrong side of a jump: so it is read twice.
    """
    fitted, best = fitted_and_best(record(SESSION, DRIFT, HOP), DRIFT, HOP)
    assert np.sqrt(fitted.spectrum.total) > 2.0 * NOISE
    for _ in range(2):
        refined = with_refined_noise(fitted, best)
        assert refined is not None
        assert refined.spectrum.total < fitted.spectrum.total
        assert refined.whitener.spectrum is refined.spectrum
        assert refined.eta_fixed[0].whitener is refined.whitener
        as_before = refined.refit.evaluate(fitted.state.values, ())
        assert refined.state.cost < as_before.cost  # the base is fitted with the new weights
        fitted, best = refined, best_of(refined, DRIFT, HOP)
    assert np.sqrt(fitted.spectrum.total) == pytest.approx(NOISE, rel=0.1)
    assert with_refined_noise(fitted, best) is None


def test_an_effect_that_repeats_with_the_scan_leaves_the_noise_as_it_was():
    fitted, best = fitted_and_best(record(SESSION, ETALON), ETALON)
    assert with_refined_noise(fitted, best) is None


def test_without_effects_or_without_a_measured_noise_there_is_nothing_to_read():
    fitted, best = fitted_and_best(record(SESSION, DRIFT, HOP))
    assert with_refined_noise(fitted, best) is None
    single = drives((10.0, 25.0), periods=1, samples=400)
    fitted, best = fitted_and_best(record(single, HOP), HOP)
    assert not fitted.spectrum.measured and with_refined_noise(fitted, best) is None
