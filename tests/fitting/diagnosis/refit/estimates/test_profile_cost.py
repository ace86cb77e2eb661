"""The profile of chi-square beside the cost that a refit of all that is smooth ends at."""

import dataclasses

import numpy as np
import pytest
from edge_worlds import NOISE, drives, record

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import effect_values, with_values
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.refit.estimates._estimates import standard_errors
from fitting.diagnosis.refit.estimates._profile_cost import ProfileCost
from rapi_jax.effects import Quantisation
from rapi_jax.examples import paper_device

# Turning points and 192 samples a period, so that the drive meets a step at few phases of it only.
TRUE = Quantisation(step=6.0 / 2**8, origin=1.5)
STEP, ORIGIN = 0, 1


@pytest.fixture(scope="module")
def found():
    recording = record(drives(), TRUE)
    whitened = WhitenedModel.of(recording)
    base = BaseModel.of(whitened, paper_device().operator).with_fixed("b")
    refit = Refit(whitened, whitened.make_whitener(Spectrum.of_white(NOISE**2)), base)
    state = refit.minimise(refit.evaluate(base.prior_mean, (TRUE,)), 10)
    state = refit.evaluate(state.values, (TRUE,))
    return refit, dataclasses.replace(refit, freeze_jumps=True).minimise(state, 20)


@pytest.fixture(scope="module")
def profile(found) -> ProfileCost:
    refit, state = found
    matrix, _, effects = refit.normal_equations(state)
    return ProfileCost.of(refit, state, matrix, effects, np.zeros(2, dtype=bool))


def moved(found, origin):
    refit, state = found
    values = effect_values(state.effects) + np.array([0.0, origin])
    return refit.evaluate(state.values, with_values(state.effects, values))


@pytest.mark.parametrize("origin", [1e-9, 2e-5, -1e-4, 1e-3])
def test_it_is_what_a_refit_ends_at(found, profile, origin):
    other = moved(found, origin)
    end = dataclasses.replace(found[0], freeze_jumps=True).minimise(other, 20)
    assert profile(other) == pytest.approx(end.cost, abs=0.05, rel=1e-3)


def test_levels_that_rise_together_are_a_constant(found, profile):
    """So little that no reading changes its level: the operator's own constant takes it up."""
    refit, state = found
    shift = 1e-6 * TRUE.step.item()
    assert profile(moved(found, shift)) == pytest.approx(profile(state), abs=1e-6)


def test_an_origin_is_known_no_better_than_the_readings_tell(found):
    """Between the two nearest origins at which a reading changes its level they tell nothing."""
    refit, state = found
    step, origin = effect_values(state.effects)
    drive = np.concatenate([run.drive.value for run in refit.whitened.recording.runs])
    phase = np.mod((drive - origin) / step - 0.5, 1.0) * step  # above the edge between two levels
    plateau = phase.min() + (step - phase).min()
    assert standard_errors(refit, state)[ORIGIN] >= 0.5 * plateau
