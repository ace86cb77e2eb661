"""Turning points of signals whose turns are known by construction."""

import numpy as np
import pytest

from rapi_jax.sampling._phase import turning_phases

SWING = 5.0  # V
NOISE = 2e-3  # V


def triangle(cycles, duty):
    phase = np.mod(cycles, 1.0)
    return 0.5 + SWING * np.where(phase < duty, phase / duty, (1.0 - phase) / (1.0 - duty))


def sine(cycles, duty):
    del duty  # its branches are equal
    return 0.5 + SWING * (1.0 - np.cos(2 * np.pi * cycles)) / 2


def errors(wave, duty, per_period, noise=0.0, count=6):
    """Of both turning phases, in periods, wherever the record begins and ends."""
    rng = np.random.default_rng(round(1000 * duty + per_period))
    for periods in (1.0, 3.4):
        for shift in rng.uniform(size=count):
            cycles = np.arange(int(per_period * periods)) / per_period
            value = wave(cycles - shift, duty) + noise * rng.standard_normal(cycles.size)
            low, high = turning_phases(cycles, value)
            for error in (low - shift, high - shift - duty):
                yield abs((error + 0.5) % 1.0 - 0.5)


@pytest.mark.parametrize("per_period", [50, 77.3, 200, 1000, 5000])
@pytest.mark.parametrize(
    ("wave", "duty"), [*((triangle, d) for d in (0.3, 0.4, 0.5, 0.6, 0.7)), (sine, 0.5)]
)
def test_turns_are_found_between_samples(wave, duty, per_period):
    assert max(errors(wave, duty, per_period)) < (1e-12 if wave is triangle else 3e-5)


@pytest.mark.parametrize(
    ("per_period", "bound"), [(50, 1e-3), (77.3, 2e-3), (200, 5e-4), (2000, 2e-4)]
)
@pytest.mark.parametrize(("wave", "duty"), [(triangle, 0.3), (triangle, 0.5), (sine, 0.5)])
def test_noise_moves_turns_by_little(wave, duty, per_period, bound):
    assert max(errors(wave, duty, per_period, NOISE)) < bound


def test_a_corner_of_curved_sides_is_where_they_meet():
    """Sides of a loop: each a parabola in time, as a piezo answers a triangle."""
    cycles = np.arange(1500) / 500 - 0.137
    phase = np.mod(cycles, 1.0)
    up = phase < 0.5
    along = np.where(up, 2 * phase, 2 * (1 - phase))
    value = along + np.where(up, 0.3, -0.3) * along * (1.0 - along)
    low, high = turning_phases(cycles + 0.137, value)
    assert (low, high) == pytest.approx((0.137, 0.637), abs=1e-9)


def test_a_flyback_of_a_tenth_of_the_period():
    assert max(errors(triangle, 0.9, 1000)) < 1e-12


def test_readings_that_are_no_numbers_are_left_out():
    cycles = np.arange(1000) / 500
    value = triangle(cycles - 0.2, 0.4)
    value[::7] = np.nan
    assert turning_phases(cycles, value) == pytest.approx((0.2, 0.6), abs=1e-12)


@pytest.mark.parametrize("noise", [0.0, NOISE])
def test_a_plateau_is_its_own_turning_point(noise):
    cycles = np.arange(1600) / 400
    value = np.where(np.mod(cycles, 1.0) < 0.5, 0.0, SWING)
    low, high = turning_phases(cycles, value + noise * np.random.default_rng(0).normal(size=1600))
    assert -0.01 < low < 0.51 and 0.49 < high < 1.01


def test_the_lowest_of_several_dips_is_taken():
    """A multisine's lowest place, against a search on a grid of 1e-6 of a period."""

    def wave(c):
        return -np.cos(2 * np.pi * c) - 0.7 * np.cos(2 * np.pi * (5 * c - 0.1))

    dense = np.arange(1_000_000) / 1e6
    cycles = np.arange(2000) / 1000
    found = turning_phases(cycles, wave(cycles))
    truth = dense[np.argmin(wave(dense))], dense[np.argmax(wave(dense))]
    assert found == pytest.approx(truth, abs=1e-4)


def test_a_constant_has_turning_phases_of_a_period():
    assert all(0.0 <= turn < 1.0 for turn in turning_phases(np.arange(300) / 100, np.ones(300)))
