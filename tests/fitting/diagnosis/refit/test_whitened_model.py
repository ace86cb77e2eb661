"""The engine's errors and derivatives against `predict`, plain NumPy and central differences."""

import dataclasses

import numpy as np
import pytest
from edge_worlds import NOISE, drives, off, record, wandering

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._effect_vector import effect_values, free_parameters, with_values
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import ECDL, Recording, predict
from rapi_jax.effects import (
    AmplifierLowpass,
    AmplitudeLaw,
    Creep,
    CurrentCoupling,
    Drift,
    Etalon,
    RateLaw,
    SlewLimit,
)
from rapi_jax.examples import paper_device

WHITE = Spectrum.of_white(NOISE**2)
EFFECTS = {
    "none": (),
    "drive": (AmplifierLowpass(tau=2e-3),),
    "law": (RateLaw(exponent=1.3), AmplitudeLaw(gain=0.02, threshold=0.1)),
    "optical": (Etalon(amplitude=0.3, spacing=20.0, phase=0.4), CurrentCoupling(coupling=2e-3)),
    "drive and optical": (AmplifierLowpass(tau=2e-3), Etalon(amplitude=0.3, spacing=20.0)),
    "a drive that bends between samples": (SlewLimit(limit=100.0), AmplifierLowpass(tau=2e-3)),
    "coupling beside it": (SlewLimit(limit=100.0), CurrentCoupling(coupling=2e-3)),
}


@pytest.fixture(scope="module")
def recording():
    return record(drives(phase=0.37, periods=4))


@pytest.fixture(scope="module")
def refit(recording):
    whitened = WhitenedModel.of(recording)
    return Refit(whitened, whitened.make_whitener(WHITE), BaseModel.of(whitened, off(0.01)))


@pytest.mark.parametrize("name", EFFECTS)
def test_errors_are_those_of_predict(name, refit, recording):
    """What the engine tiles from one period is what the model answers to the whole run."""
    ecdl = ECDL(refit.base.operator, EFFECTS[name])
    state = refit.evaluate(refit.base.prior_mean, ecdl.effects)
    for run, block, raw in zip(
        recording.runs, refit.whitened.blocks, state.errors.raw, strict=True
    ):
        want = np.asarray(predict(ecdl, run.drive)) - run.response
        first = int(np.flatnonzero(run.drive.period >= 0)[0])
        np.testing.assert_allclose(raw.ravel(), want[first:][: block.size], atol=2e-8)


def test_errors_between_samples_are_those_of_predict():
    """With 200.37 samples a period nothing is tiled; both are read by straight lines."""
    recording = record(drives(samples=200.37, periods=3.4))
    whitened = WhitenedModel.of(recording)
    operator = paper_device().operator
    state = Refit(
        whitened, whitened.make_whitener(WHITE), BaseModel.of(whitened, operator)
    ).evaluate(BaseModel.of(whitened, operator).prior_mean, ())
    for run, block, raw in zip(recording.runs, whitened.blocks, state.errors.raw, strict=True):
        error = np.asarray(predict(ECDL(operator), run.drive)) - run.response
        want = np.interp(block.time - run.drive.start_s, run.drive.time, error)
        # The model has the corner that falls between two samples, straight lines do not.
        inside = np.ones(want.shape[1], dtype=bool)
        inside[np.abs(block.phase - 0.5) < 0.01] = False
        inside[(block.phase < 0.01) | (block.phase > 0.99)] = False
        np.testing.assert_allclose(raw[:, inside], want[:, inside], atol=1e-6)


def test_whitened_errors_hold_all_of_the_errors(refit):
    """Parseval: chi-square, locked and not, is the sum of squares over the noise's variance."""
    state = refit.evaluate(refit.base.prior_mean, ())
    squares = sum(float((e**2).sum()) for e in state.errors.raw)
    assert state.synchronous + state.nonsynchronous == pytest.approx(squares / NOISE**2, rel=1e-10)
    mean = sum(e.shape[0] * float((e.mean(axis=0) ** 2).sum()) for e in state.errors.raw)
    assert state.synchronous == pytest.approx(mean / NOISE**2, rel=1e-10)
    assert state.cost == state.synchronous + state.nonsynchronous


def test_noise_alone_is_white_of_unit_variance(recording):
    """At the truth; four standard errors of a mean of squares, sqrt(2 / n) each."""
    whitened = WhitenedModel.of(recording)
    base = BaseModel.of(whitened, paper_device().operator)
    errors = (
        Refit(whitened, whitened.make_whitener(WHITE), base).evaluate(base.prior_mean, ()).errors
    )
    for part in (errors.synchronous, errors.nonsynchronous):
        assert abs(np.mean(part**2) - 1.0) < 4.0 * np.sqrt(2.0 / part.size)
    assert errors.synchronous.size + errors.nonsynchronous.size == sum(
        b.size for b in whitened.blocks
    )


@pytest.mark.parametrize("name", EFFECTS)
def test_columns_of_the_operator_are_central_differences(name, refit):
    """Steps of 1e-5; play outputs have kinks, each of which errs by a step in one sample."""
    state = refit.evaluate(refit.base.prior_mean, EFFECTS[name])
    columns = refit.jacobian_base(state)
    for i, value in enumerate(state.values):
        step = 1e-5 * max(abs(value), 1e-2)
        ends = []
        for sign in (1.0, -1.0):
            moved = state.values.copy()
            moved[i] += sign * step
            ends.append(refit.evaluate(moved, state.effects).errors.synchronous)
        want = (ends[0] - ends[1]) / (2.0 * step)
        assert np.linalg.norm(columns[:, i] - want) <= 1e-3 * np.linalg.norm(want), i


@pytest.mark.parametrize("name", [n for n in EFFECTS if n != "none"])
def test_columns_of_effects_are_central_differences(name, refit):
    """They are taken by one step of 0.3 % of a parameter: right to a few percent."""
    state = refit.evaluate(refit.base.prior_mean, EFFECTS[name])
    columns = refit.jacobian_effects(state)
    now = effect_values(state.effects)
    sizes = [p.high - p.low for e in state.effects for p in free_parameters(e)]
    assert columns.shape == (
        state.errors.synchronous.size + state.errors.nonsynchronous.size,
        now.size,
    )
    for i, value in enumerate(now):
        step = 1e-4 * (abs(value) or min(sizes[i], 1.0))
        ends = []
        for sign in (1.0, -1.0):
            moved = now.copy()
            moved[i] += sign * step
            errors = refit.evaluate(state.values, with_values(state.effects, moved)).errors
            ends.append(np.concatenate([errors.synchronous, errors.nonsynchronous]))
        want = (ends[0] - ends[1]) / (2.0 * step)
        assert np.linalg.norm(columns[:, i] - want) <= 0.05 * np.linalg.norm(want), i


def test_effects_not_locked_to_the_scan_show_in_what_is_not(refit):
    state = refit.evaluate(refit.base.prior_mean, ())
    for effect in (Drift(amplitude=0.5, tau=1.0), Creep(gain=0.02)):
        moved = refit.evaluate(refit.base.prior_mean, (effect,))
        assert np.linalg.norm(moved.errors.nonsynchronous - state.errors.nonsynchronous) > 1.0


def test_masked_readings_have_no_say(recording):
    """Whatever a masked reading would have been, errors and columns are the same."""
    runs = [run.response.copy() for run in recording.runs]
    for y in runs:
        y[300:340] = np.nan
    masked = Recording.of(recording.drives, runs)
    whitened = WhitenedModel.of(masked)
    refit = Refit(whitened, whitened.make_whitener(WHITE), BaseModel.of(whitened, off(0.01)))
    state = refit.evaluate(refit.base.prior_mean, ())
    for raw, block in zip(state.errors.raw, whitened.blocks, strict=True):
        assert (block.use == 0).sum() == 40
        np.testing.assert_array_equal(raw[block.use == 0], 0.0)
    full = WhitenedModel.of(recording)
    both = Refit(full, full.make_whitener(WHITE), BaseModel.of(full, off(0.01))).evaluate(
        refit.base.prior_mean, ()
    )
    for some, every, block in zip(state.errors.raw, both.errors.raw, whitened.blocks, strict=True):
        np.testing.assert_allclose(some, every * block.use, atol=1e-12)


def test_a_run_that_does_not_repeat_starts_anywhere():
    """It has a fraction for each play, which moves nothing of the run that repeats."""
    recording = record([drives((10.0,))[0], dataclasses.replace(wandering(), start_s=1.0)])
    whitened = WhitenedModel.of(recording)
    operator = paper_device().operator
    base = BaseModel.of(whitened, operator)
    assert whitened.initial_state_size(operator.count) == operator.count
    refit = Refit(whitened, whitened.make_whitener(WHITE), base)
    state = refit.evaluate(base.prior_mean, ())
    moved = base.prior_mean.copy()
    moved[-operator.count :] = 1.0
    other = refit.evaluate(moved, ())
    np.testing.assert_array_equal(other.errors.raw[0], state.errors.raw[0])
    shift = np.abs(other.errors.raw[1] - state.errors.raw[1])[0]
    assert shift[0] > 0.1 and shift[-1] < 1e-9  # forgotten once all plays have moved


def test_runs_with_their_own_origin_do_not_see_a_constant(recording):
    shifted = dataclasses.replace(
        recording,
        response_origin="run",
        runs=tuple(
            dataclasses.replace(run, response=run.response + 7.0 * k)
            for k, run in enumerate(recording.runs)
        ),
    )
    states = []
    for one in (dataclasses.replace(recording, response_origin="run"), shifted):
        whitened = WhitenedModel.of(one)
        base = BaseModel.of(whitened, off(0.01))
        states.append(
            Refit(whitened, whitened.make_whitener(WHITE), base).evaluate(base.prior_mean, ())
        )
    np.testing.assert_allclose(
        states[1].errors.synchronous, states[0].errors.synchronous, atol=1e-6
    )
    np.testing.assert_allclose(
        states[1].errors.nonsynchronous, states[0].errors.nonsynchronous, atol=1e-6
    )
