"""Jumps that come early or late, and a base beside them: closed forms and a device far off."""

import dataclasses

import equinox as eqx
import numpy as np
import pytest
from edge_worlds import NOISE, drives, off, record

from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._jump_timing import match_jump_timing
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which.jumps._jump_segmentation import refit_at_segmented_jumps
from rapi_jax.effects import Delay, ModeHop

WHITE = Spectrum.of_white(NOISE**2)
HOP = ModeHop.at(size=-1.5, threshold=80.0, width=1.4, settle_s=1e-9)


def refit_of(recording, share):
    whitened = WhitenedModel.of(recording)
    return Refit(whitened, whitened.make_whitener(WHITE), BaseModel.of(whitened, off(share)))


@pytest.fixture(scope="module")
def recording():
    return record(drives(periods=4), HOP)


@pytest.fixture(scope="module")
def refit(recording):
    return refit_of(recording, 0.03)


def step(error, at, by, block, size=1.5):
    """Errors of a run whose model switches `by` readings late, and what its switch adds."""
    place = block.left.ravel()  # of each reading; others lie between
    row, true = np.zeros((2, block.left.max() + 1))
    row[place[at + by] :] = size
    true[place[at] :] = size
    return error + block.interpolate(row) - block.interpolate(true), row


@pytest.mark.parametrize(("by", "paid"), [(0, 0.0), (1, 4.0), (-1, 4.0), (2, 4.0)])
def test_one_reading_is_forgiven_at_the_price_of_two_sigma(refit, by, paid):
    block = refit.whitened.blocks[0]
    rng = np.random.default_rng(1)
    noise = NOISE * rng.standard_normal(block.left.shape)
    error, row = step(noise, 217, by, block)
    found, price = match_jump_timing(error, [row], block, NOISE**2)
    assert price == paid
    wrong = max(abs(by) - 1, 0)
    left = np.sort(np.abs(found - noise).ravel())
    np.testing.assert_allclose(left[: left.size - wrong], 0, atol=1e-9)
    assert (np.abs(found - noise) > 1.0).sum() == wrong


def test_what_does_not_jump_is_left_alone(refit):
    block = refit.whitened.blocks[0]
    error = 30 * NOISE * np.random.default_rng(2).standard_normal(block.left.shape)
    flat = np.full(block.left.max() + 1, 0.7)
    found, price = match_jump_timing(error, [flat], block, NOISE**2)
    assert price == 0.0 and found is error


def test_what_a_jump_costs_is_counted(refit, recording):
    """A threshold half a reading off is worth a few sigmas, not one jump a period."""
    late = ModeHop.at(size=-1.5, threshold=80.1, width=1.5, settle_s=1e-9)
    truth = refit_of(recording, 0.0)
    exact, moved = (truth.evaluate(truth.base.prior_mean, (hop,)) for hop in (HOP, late))
    assert exact.errors.jump_timing_cost == 0.0 < moved.errors.jump_timing_cost
    assert moved.cost - exact.cost < 3.0 * moved.errors.jump_timing_cost
    assert (
        moved.cost
        == moved.synchronous
        + moved.nonsynchronous
        + moved.prior_cost
        + moved.errors.jump_timing_cost
    )


def test_places_are_those_that_the_states_bound():
    nu = np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.0, 0.0, 1.5])
    on = np.array([0, 0, 0, 1, 1, 0, 0, 0], dtype=bool)
    run = np.array([0] * 7 + [1])
    found = HOP.with_states(nu, on, run)
    assert float(found.threshold) == 2.5 and float(found.width) == 1.0
    assert float(found.size) == -1.5
    assert HOP.with_states(nu, np.zeros(8, dtype=bool), run) is HOP
    # Of states that no threshold gives, the one that breaks them least: half-way.
    nu[2] = 3.4
    assert float(HOP.with_states(nu, on, run).threshold) == pytest.approx(3.2, abs=1e-9)


def test_a_base_far_off_comes_back_beside_a_hop(refit):
    """From 3 % off the model crosses the threshold at the wrong readings."""
    wrong = dataclasses.replace(HOP, threshold=HOP.threshold - 2.0)
    start = refit.evaluate(refit.base.prior_mean, (wrong,))
    end = refit_at_segmented_jumps(refit, start, 40)
    assert end is not None
    lines = end.errors.synchronous.size
    assert start.synchronous > 100 * lines
    assert end.synchronous < lines + 4.0 * np.sqrt(2.0 * lines)
    (hop,) = end.effects
    assert float(hop.threshold) == pytest.approx(80.0, abs=0.25)
    assert float(hop.threshold - hop.width) == pytest.approx(78.6, abs=0.25)


def test_there_is_nothing_to_place_without_a_switch_that_shows(refit):
    values = refit.base.prior_mean
    assert refit_at_segmented_jumps(refit, refit.evaluate(values, (Delay(tau=1e-4),)), 4) is None
    small = ModeHop.at(size=2 * NOISE, threshold=80.0, width=1.4, settle_s=1e-9)
    assert refit_at_segmented_jumps(refit, refit.evaluate(values, (small,)), 4) is None


def test_masked_readings_say_nothing_of_thresholds(recording):
    """They are zeros, far above a threshold at -120 GHz."""
    shifted = []
    for run in recording.runs:
        response = run.response - 200.0
        response[3::200] = np.nan
        shifted.append(dataclasses.replace(run, response=response))
    whitened = WhitenedModel.of(dataclasses.replace(recording, runs=tuple(shifted)))
    operator = eqx.tree_at(lambda o: o.d_0, off(0.0), replace_fn=lambda d: d - 200.0)
    masked = Refit(whitened, whitened.make_whitener(WHITE), BaseModel.of(whitened, operator))
    low = dataclasses.replace(HOP, threshold=HOP.threshold - 200.0)
    end = refit_at_segmented_jumps(masked, masked.evaluate(masked.base.prior_mean, (low,)), 40)
    assert end is not None
    (hop,) = end.effects
    assert float(hop.threshold) == pytest.approx(-120.0, abs=0.25)
    assert float(hop.threshold - hop.width) == pytest.approx(-121.4, abs=0.25)
