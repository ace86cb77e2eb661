"""Another form of an effect: its evidence in closed form, and where it is named."""

import dataclasses

import numpy as np
import pytest
from edge_worlds import NOISE, drives, off, record
from scipy.stats import multivariate_normal

from fitting import diagnose
from fitting.diagnosis.mechanism._other_form import refit_form
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import Recording
from rapi_jax.effects import Delay, Etalon, Pickup

SESSION = drives((10.0, 40.0), amplitudes=(3.0, 2.0))


def with_added(added) -> Recording:
    """The paper's device, to whose readings `added(time, drive)` (GHz) is added in each run."""
    recording = record(SESSION)
    runs = [
        run.response + added(run.drive.start_s + run.drive.time, run.drive.value)
        for run in recording.runs
    ]
    return Recording.of(SESSION, runs)


def pulses(time: np.ndarray, drive: np.ndarray) -> np.ndarray:
    """Of a dimmer: two a cycle of 50 Hz, of opposite signs."""
    del drive
    number = np.round((time - 0.004) / 0.01)
    return (
        0.3
        * np.where(number % 2, -1.0, 1.0)
        * np.exp(-(((time - 0.004 - 0.01 * number) / 8e-4) ** 2))
    )


@pytest.fixture(scope="module")
def stood() -> tuple[Refit, State]:
    """A refit of a short recording, and a state some way off."""
    whitened = WhitenedModel.of(record(drives(samples=60)))
    base = BaseModel.of(whitened, off(0.001))
    refit = Refit(whitened, whitened.make_whitener(Spectrum.of_white(NOISE**2)), base)
    return refit, refit.evaluate(base.prior_mean, ())


def test_its_cost_is_that_of_the_marginal_likelihood(stood):
    """A normal density whose covariance has the functions' beside the noise's, the best scale's."""
    refit, state = stood
    rng = np.random.default_rng(0)
    functions = [0.02 * rng.standard_normal((7, *b.time.shape)) for b in refit.whitened.blocks]
    end = refit_form(refit, state, functions)
    columns = np.concatenate(refit.whitener.whiten(functions), axis=1)
    errors = state.errors.all

    def minus_twice_log(scale: float) -> float:
        covariance = np.eye(errors.size) + scale**2 * columns.T @ columns
        law = multivariate_normal(np.zeros(errors.size), covariance)
        return -2.0 * float(law.logpdf(errors)) - errors.size * np.log(2.0 * np.pi)

    best = min(minus_twice_log(scale) for scale in np.geomspace(1e-3, 1e2, 26))
    assert end.cost - state.prior_cost == pytest.approx(best, rel=1e-9)
    assert end.cost <= state.cost


def test_functions_of_which_the_errors_are_a_sum_leave_the_noise(stood):
    refit, state = stood
    rng = np.random.default_rng(1)
    functions = [0.5 * rng.standard_normal((4, *b.time.shape)) for b in refit.whitened.blocks]
    sizes = np.array([1.0, -0.4, 0.2, 0.0])
    there = refit.whitener.whiten([np.tensordot(sizes, f, 1) for f in functions])
    moved = state.errors._replace(
        synchronous=state.errors.synchronous + there[0],
        nonsynchronous=state.errors.nonsynchronous + there[1],
    )
    end = refit_form(refit, dataclasses.replace(state, errors=moved), functions)
    before = float(state.errors.all @ state.errors.all)
    assert float(end.errors.all @ end.errors.all) < before + 4.0
    assert float(moved.all @ moved.all) > 20.0 * before


@pytest.mark.slow
def test_another_form_is_named_and_said_to_be_one():
    found = diagnose(None, with_added(pulses), candidates=(Etalon, Pickup), scan=False)
    assert found.verdict.name == "pickup" and found.verdict.probability > 0.9
    assert any("another form than the model's equation" in note for note in found.notes)


@pytest.mark.slow
def test_what_no_form_explains_stays_unlisted():
    """A dispersive curve about one voltage: no harmonics in time."""

    def curve(time, drive):
        x = (drive - 3.3) / 0.08
        return 0.5 * x / (1.0 + x**2)

    found = diagnose(None, with_added(curve), candidates=(Pickup, Delay), scan=False)
    assert found.verdict.name == "unlisted"
    assert not any("another form" in note for note in found.notes)
