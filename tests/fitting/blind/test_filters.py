"""Filters of the generator against exact answers."""

import numpy as np
import pytest

from fitting.blind.simulator._filters import (
    delay_signal,
    lag,
    limit_slope,
    lowpass,
    rational_filter,
    second_order,
)
from fitting.blind.simulator._scan import Scan

STEP = 1e-5
T: np.ndarray = np.arange(20001, dtype=np.float64) * np.float64(STEP)


@pytest.mark.parametrize("tau", [3e-6, 1e-4, 2e-2, 50.0])
def test_a_lag_answers_a_ramp_exactly(tau):
    found = lowpass(4.0 * T, STEP, tau)
    np.testing.assert_allclose(found, 4.0 * (T + tau * np.expm1(-T / tau)), rtol=1e-8, atol=1e-9)


def test_a_lag_goes_on_from_the_state_it_is_given():
    tau, x = 3e-3, np.sin(90 * T)
    whole = lowpass(x, STEP, tau)
    half = lag(x[7000:], STEP, tau, (float(x[6999]), float(whole[6999])))
    np.testing.assert_allclose(half, whole[7000:], atol=1e-12)


@pytest.mark.parametrize("top", [None, (900.0, 0.05)])
def test_a_mode_has_its_gain_and_phase_and_passes_what_rests(top):
    bottom = second_order(600.0, 0.1)
    numerator = second_order(*top) if top else [1.0]
    s = 2j * np.pi * 250.0
    response = np.polyval(numerator, s) / np.polyval(bottom, s)
    found = rational_filter(3.0 + np.sin(2 * np.pi * 250.0 * T), STEP, numerator, bottom)
    expected = 3.0 + np.imag(response * np.exp(s * T))
    np.testing.assert_allclose(found[10000:], expected[10000:], atol=2e-4)
    np.testing.assert_allclose(rational_filter(np.full(50, 7.0), STEP, numerator, bottom), 7.0)


def test_a_mode_rings_at_its_frequency_after_a_corner():
    """The known error of a second-order system behind a ramp: its lag, and a ringing that dies."""
    w, z = 2 * np.pi * 600.0, 0.01
    wd = w * np.sqrt(1 - z**2)
    found = rational_filter(4.0 * T, STEP, [1.0], second_order(600.0, z)) - 4.0 * T
    ringing = 2 * z / w * np.cos(wd * T) + (2 * z**2 - 1) / wd * np.sin(wd * T)
    expected = 4.0 * (-2 * z / w + np.exp(-z * w * T) * ringing)
    np.testing.assert_allclose(found, expected, atol=1e-6 * 4.0 / w)


def test_a_delay_shifts_by_less_than_a_step_too():
    np.testing.assert_allclose(
        delay_signal(5 * T, STEP, 0.3 * STEP)[1:], 5 * (T[1:] - 0.3 * STEP), atol=1e-15
    )


def test_a_slew_limit_holds_and_makes_a_smaller_triangle():
    scan = Scan(50.0, 4.0, 3.0, "triangle", 6, 2000)
    u = scan.drive  # 400 V/s
    found = limit_slope(u, scan.step_s, 300.0)
    assert np.max(np.abs(np.diff(found))) <= 300.0 * scan.step_s * (1 + 1e-9)
    assert np.ptp(found[6000:]) == pytest.approx(300.0 * 0.01, rel=1e-3)
    assert limit_slope(u, scan.step_s, 400.1) is u
