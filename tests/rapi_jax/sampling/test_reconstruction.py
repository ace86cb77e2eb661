"""A coarsely sampled drive between its samples: against the waveform it was sampled from."""

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rapi_jax import ECDL, Drive, effects, predict
from rapi_jax.examples import paper_device
from rapi_jax.sampling._corners import bends, corners
from rapi_jax.sampling._reconstruction import (
    nodes_between_samples,
    periodic_nodes_between_samples,
)

FINER = 64  # samples of the reference for one of the coarse drive


def trapezoid(cycles, hold=0.2):
    """From -1/2 to 1/2; rests for `hold` of a period at either end."""
    ramp = 0.5 - hold
    knots = [0.0, hold / 2, hold / 2 + ramp, 1.5 * hold + ramp, 1.5 * hold + 2 * ramp, 1.0]
    return np.interp(np.mod(cycles, 1.0), knots, [-0.5, -0.5, 0.5, 0.5, -0.5, -0.5])


def skewed(cycles, rise=0.63):
    return np.interp(np.mod(cycles, 1.0), [0.0, rise, 1.0], [-0.5, 0.5, -0.5])


def sine(cycles):
    return -0.5 * np.cos(2 * np.pi * cycles)


def multisine(cycles):
    return 0.4 * np.sin(2 * np.pi * cycles) + 0.1 * np.cos(6 * np.pi * cycles + 1.0)


WAVES = {"trapezoid": trapezoid, "skewed": skewed, "sine": sine, "multisine": multisine}


def drive_of(wave: str, per_period: int, hz: float, *, finer: int = 1) -> Drive:
    """Two periods from a quarter of one on."""
    time = np.arange(per_period * finer * 2) / (per_period * finer * hz)
    value = 3.0 + 4.0 * WAVES[wave](time * hz + 0.25)
    return Drive(time, value, hz, "sine" if wave == "sine" else "multisine")


# --- corners that are no turning points


@settings(max_examples=60)
@given(st.floats(0.15, 0.35), st.integers(60, 300), st.floats(0.0, 1.0))
def test_corners_between_a_ramp_and_a_level_part_are_exact(hold, per_period, phase):
    """Between samples by `corners`, on samples by `bends`, four a period."""
    at, height = bends(trapezoid(np.arange(3 * per_period) / per_period + phase, hold))
    ends = np.array([hold / 2, 0.5 - hold / 2, 0.5 + hold / 2, 1.0 - hold / 2])
    want = (ends[None, :] + np.arange(-1, 4)[:, None] - phase).ravel() * per_period
    inner = want[(want > 8) & (want < 3 * per_period - 9)]
    found = np.abs(at[:, None] - inner[None, :])
    assert found.min(axis=0).max() < 1e-6
    told = (at > 2) & (at < 3 * per_period - 3)  # next to an end one sample tells no line
    assert np.abs(at[told, None] - want[None, :]).min(axis=1).max() < 1e-6
    np.testing.assert_allclose(np.abs(height[told]), 0.5, rtol=0, atol=1e-9)


def test_a_corner_on_a_sample_is_a_bend_and_no_corner_between_samples():
    value = trapezoid(np.arange(200) / 100)  # ramps begin at 10, 40, 60 and 90
    at, _ = bends(value)
    np.testing.assert_allclose(at, [10, 40, 60, 90, 110, 140, 160, 190], rtol=0, atol=1e-6)
    assert corners(value)[0].size == 0


@pytest.mark.parametrize("per_period", [30, 61, 200, 2000])
@pytest.mark.parametrize("wave", ["sine", "multisine"])
def test_a_smooth_curve_has_no_corner(wave, per_period):
    assert bends(WAVES[wave](np.arange(3 * per_period) / per_period + 0.1))[0].size == 0


# --- the drive between its samples


@pytest.mark.parametrize("per_period", [60, 97, 200])
@pytest.mark.parametrize("phase", [0.0, 0.123])
@pytest.mark.parametrize("wave", WAVES)
def test_nodes_lie_on_the_waveform(wave, phase, per_period):
    """Of a smooth one straight lines miss at least 30 times as much."""
    value = WAVES[wave](np.arange(per_period) / per_period + phase)
    at, height = periodic_nodes_between_samples(value, finer=True)
    assert (np.diff(at) > 0).all() and at.min() >= 0 and at.max() < per_period
    assert at.size + per_period >= (400 if wave in ("sine", "multisine") else 300)
    want = WAVES[wave](at / per_period + phase)
    off = np.abs(height - want).max()
    if wave in ("trapezoid", "skewed"):
        assert off < 1e-9
    else:
        straight = np.interp(at, np.arange(per_period), value, period=per_period)
        assert off < np.abs(straight - want).max() / 30


@pytest.mark.parametrize("wave", WAVES)
def test_without_finer_places_the_extremes_are_reached(wave):
    """Thresholds follow what the drive reaches, though no sample lies there."""
    value = WAVES[wave](np.arange(61) / 61 + 0.1234)
    fine = WAVES[wave](np.arange(10**6) / 10**6)
    at, height = periodic_nodes_between_samples(value, finer=False)
    assert at.size <= 6
    both = np.concatenate([value, height])
    assert both.max() == pytest.approx(fine.max(), abs=1e-5)
    assert both.min() == pytest.approx(fine.min(), abs=1e-5)


def test_broken_samples_a_period_are_finer_too():
    exact = 60.37
    value = sine(np.arange(400) / exact + 0.2)
    at, height = nodes_between_samples(value, exact, finer=True)
    inside = (at > 10) & (at < 389)  # at the ends of a record a spline is not as sure
    want = sine(at[inside] / exact + 0.2)
    np.testing.assert_allclose(height[inside], want, rtol=0, atol=2e-6)


def test_drives_sampled_finely_and_without_a_rate_keep_their_samples():
    for samples_a_period in (400.0, 0.0):
        value = sine(np.arange(800) / 400)
        assert nodes_between_samples(value, samples_a_period, finer=True)[0].size == 0


@pytest.mark.parametrize(
    "value",
    [
        np.random.default_rng(0).normal(size=300),
        sine(np.arange(300) / 100) + 0.02 * np.random.default_rng(1).normal(size=300),
        np.floor(np.arange(300) / 13.5),
    ],
    ids=["noise", "a noisy sine", "stairs"],
)
def test_nothing_is_drawn_through_what_is_not_smooth(value):
    assert nodes_between_samples(value, 100.0, finer=True)[0].size == 0


@pytest.mark.parametrize("wave", ["trapezoid", "skewed"])
def test_a_table_of_six_digits_is_as_straight(wave):
    value = np.round(WAVES[wave](np.arange(61) / 61 + 0.123), 6)
    at, height = periodic_nodes_between_samples(value, finer=True)
    assert at.size + 61 >= 300
    np.testing.assert_allclose(height, WAVES[wave](at / 61 + 0.123), rtol=0, atol=1e-5)


# --- what a model answers


EFFECTS = {
    "delay": effects.Delay.at(tau=2e-4),
    "low-pass": effects.AmplifierLowpass.at(tau=5e-5),
    "resonance": effects.Resonance.at(hertz=1000.0, damping=0.05, share=1.0),
    "slew limit": effects.SlewLimit.at(limit=300.0),
    "creep": effects.Creep.at(gain=0.02),
    "coupling": effects.CurrentCoupling.at(coupling=-0.02),
}


@functools.cache
def without_effects(wave, per_period):
    fine = drive_of(wave, per_period, 30.0, finer=FINER)
    return np.asarray(predict(paper_device(), fine))[::FINER][per_period:]


@pytest.mark.parametrize("per_period", [60, pytest.param(200, marks=pytest.mark.slow)])
@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("wave", WAVES)
def test_coarse_samples_give_the_response_of_a_fine_clock(wave, name, per_period):
    """Within 1 % of what the effect does; of a trapezoid's coupling 14 % were missed.

    A mode sees straight lines from node to node: of its small part in a smooth motion, (w h)^2 / 12
    is missed at 400 nodes a period.
    """
    model = ECDL(paper_device().operator, (EFFECTS[name],))
    coarse = drive_of(wave, per_period, 30.0)
    fine = drive_of(wave, per_period, 30.0, finer=FINER)
    want = np.asarray(predict(model, fine))[::FINER][per_period:]
    without = without_effects(wave, per_period)
    found = np.asarray(predict(model, coarse))[per_period:]
    size = np.sqrt(np.mean((want - without) ** 2))
    assert size > 0.01  # GHz: there is something to compare
    mode = (2 * np.pi * 1000.0 / (400 * 30.0)) ** 2 / 12
    most = mode if name == "resonance" else 0.01
    assert np.sqrt(np.mean((found - want) ** 2)) < most * size


@pytest.mark.parametrize("per_period", [60, 97, 200])
@pytest.mark.parametrize("wave", ["trapezoid", "skewed"])
def test_a_slew_limit_is_exact_where_it_catches_up_between_samples(wave, per_period):
    """There its output turns, and the plays remember it; 50 MHz were missed."""
    model = ECDL(paper_device().operator, (effects.SlewLimit.at(limit=300.0),))
    coarse, fine = (drive_of(wave, per_period, 30.0, finer=finer) for finer in (1, FINER))
    want = np.asarray(predict(model, fine))[::FINER][per_period:]
    without = without_effects(wave, per_period)
    found = np.asarray(predict(model, coarse))[per_period:]
    assert np.abs(want - without).max() > 0.1  # GHz
    np.testing.assert_allclose(found, want, rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", ["low-pass", "resonance", "creep"])
@pytest.mark.parametrize("wave", ["skewed", "sine"])
def test_a_staircase_behind_a_lag_is_that_of_a_fine_clock(wave, name):
    """Of 60 samples a period, between which several of 100 levels pass.

    Seen as straight lines between levels on the samples, the part that the staircase has behind the
    mode was missed by five times its size. Its mean over each step is exact now, its shape is not.
    """
    stairs = effects.Quantisation.at(step=0.04, origin=2.013)
    device, lag = paper_device().operator, EFFECTS[name]
    coarse, fine = (drive_of(wave, 60, 30.0, finer=finer) for finer in (1, FINER))
    want = np.asarray(predict(ECDL(device, (stairs, lag)), fine))[::FINER][60:]
    without = np.asarray(predict(ECDL(device, (lag,)), fine))[::FINER][60:]
    found = np.asarray(predict(ECDL(device, (stairs, lag)), coarse))[60:]
    size, off = (np.sqrt(np.mean((x - want) ** 2)) for x in (without, found))
    assert size > 0.05  # GHz
    assert off < 0.3 * size


@pytest.mark.parametrize("per_period", [60, 200])
def test_a_staircase_is_exact_on_the_samples(per_period):
    model = ECDL(paper_device().operator, (effects.Quantisation.at(step=0.04, origin=2.013),))
    coarse, fine = (drive_of("skewed", per_period, 30.0, finer=finer) for finer in (1, FINER))
    want, found = (np.asarray(predict(model, drive)) for drive in (fine, coarse))
    np.testing.assert_allclose(found[per_period:], want[::FINER][per_period:], rtol=0, atol=1e-6)
