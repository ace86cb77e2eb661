"""Widths against closed forms, and reflectors against the Cramer-Rao bound and simulation."""

import numpy as np
import pytest

from rapi_jax import DataError, examples, predict
from rapi_jax._metrics import linearity
from rapi_jax.ranging.resolution import (
    crooked_branch,
    find_reflectors,
    width_curve,
)
from rapi_jax.recording._run import Run

SIZES = np.array([0.01, 0.1, 0.5, 1.0, 5.0])  # GHz
SHAPES = ("quadratic", "cubic", "sine", "random", "up", "down")
RATE = 1.0 / 256


def _fringes(rng, bins, amplitude, *, noise, samples=256):
    place = (np.arange(samples) - (samples - 1) / 2) / samples
    phase = rng.uniform(0, 2 * np.pi, np.size(bins))
    waves = np.cos(2 * np.pi * np.atleast_1d(bins) * place[:, None] + phase)
    return 0.3 + waves @ np.atleast_1d(amplitude) + noise * rng.standard_normal(samples)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_straight_scan_has_the_width_of_its_window(shape):
    """sin^2(pi f T) / (pi f T)^2 falls to a half at 0.443 / T on either side."""
    curve = width_curve(shape, np.array([1e-5]))
    assert abs(curve.measured_hz[0] * 0.04 - 0.8859) < 2e-3
    assert abs(curve.predicted_hz[0] * 0.04 - 1.0) < 2e-3
    assert abs(curve.measured_m[0] / curve.resolution_m[0] - 0.8859) < 3e-3


def test_a_quadratic_is_a_chirp_as_wide_as_its_sweep():
    """gamma t^2 has an rms of gamma T^2 / (6 sqrt 5) and sweeps the beat over 2 gamma T tau."""
    curve = width_curve("quadratic", SIZES)
    assert abs(curve.ratio[-1] - 6 * np.sqrt(5) / np.pi) < 0.1


def test_a_sine_is_as_wide_as_its_swing():
    """Swing sqrt(2) rms, beat +- 2 pi k sqrt(2) rms tau / T; its line takes a little for k = 10."""
    curve = width_curve("sine", SIZES, periods=10.0)
    assert abs(curve.ratio[-1] / (2 * np.sqrt(2) * 10) - 1) < 0.03


@pytest.mark.parametrize("shape", SHAPES)
def test_equation_5_is_an_order_of_magnitude(shape):
    """What the curve shows: from a twentieth to nine times, by shape, at one and the same rms."""
    curve = width_curve(shape, SIZES, periods=3.0)
    assert ((curve.ratio > 0.04) & (curve.ratio < 10)).all()
    np.testing.assert_allclose(
        curve.resolution_m,
        curve.nonlinear_resolution_m * (1 + 1 / (2 * np.pi * 24.5 * SIZES)),
        rtol=1e-12,
    )  # Eq. 6 is Eq. 7 with the 1 kept


def test_branch_of_the_device_is_its_own_residual():
    run = Run(
        examples.paper_drives()[0],
        np.asarray(predict(examples.paper_device(), examples.paper_drives()[0])),
    )
    down = linearity(run).down
    made = crooked_branch(
        "down", down.rms_ghz, span_ghz=abs(down.slope_ghz_per_s) * down.duration_s
    )
    assert abs(made.rms_ghz / down.rms_ghz - 1) < 1e-9
    assert abs(made.peak_width_hz(24.5e-9) / down.peak_width_hz(24.5e-9) - 1) < 0.02


def test_shapes_that_cannot_be_are_refused():
    with pytest.raises(DataError, match="is a line"):
        crooked_branch("sine", 1.0, periods=0.0)


def test_delays_reach_the_bound_and_errors_are_theirs():
    """The bound for one sine in white noise: 24 sigma^2 / ((2 pi)^2 a^2 N), in squared bins."""
    rng, noise = np.random.default_rng(0), 0.1
    errors, amplitudes = [], []
    for _ in range(200):
        bins = rng.uniform(30, 90)
        found = find_reflectors(_fringes(rng, bins, 1.0, noise=noise), RATE, most=1)
        bound = np.sqrt(24 * noise**2 / (4 * np.pi**2 * 256))
        assert abs(found.delay_stderr_s[0] / bound - 1) < 0.2
        errors.append((found.delay_s[0] - bins) / found.delay_stderr_s[0])
        amplitudes.append((found.amplitude[0] - 1.0) / found.amplitude_stderr[0])
    assert abs(np.mean(errors)) < 0.25 and 0.85 < np.std(errors) < 1.15
    assert abs(np.mean(amplitudes)) < 0.25 and 0.85 < np.std(amplitudes) < 1.15


@pytest.mark.parametrize("ratio", (1.0, 0.1))
@pytest.mark.parametrize("separation", (0.5, 1.0, 2.0, 4.0))
def test_two_reflectors_are_told_apart(separation, ratio):
    """Closer than the width of the peak, and of a tenth of the size, at 50 to 1."""
    rng = np.random.default_rng(int(10 * separation))
    bins = 50.0 + separation * np.array([0.0, 1.0])
    found = find_reflectors(_fringes(rng, bins, [1.0, ratio], noise=0.02), RATE)
    assert found.count == 2 and len(found.p_values) == 3
    assert (np.abs(found.delay_s - bins) < 5 * found.delay_stderr_s).all()
    assert found.p_values[1] < 0.01 < found.p_values[2]
    assert abs(found.noise_rms / 0.02 - 1) < 0.15


def _false_alarms(replicates, false_alarm):
    rng = np.random.default_rng(1)
    wrong = 0
    for _ in range(replicates):
        x = _fringes(rng, rng.uniform(20, 100), 1.0, noise=0.1)
        wrong += find_reflectors(x, RATE, most=2, false_alarm=false_alarm).count != 1
    return wrong


def test_false_alarms_are_rare():
    assert 2 <= _false_alarms(200, 0.05) <= 20  # 10 expected; 3.2 standard deviations


@pytest.mark.slow
def test_false_alarms_are_as_many_as_stated():
    wrong = _false_alarms(3000, 0.02)
    assert abs(wrong - 60) < 3.5 * np.sqrt(60)


@pytest.mark.parametrize(("shape", "rms", "seen"), (("up", 0.435, 3), ("down", 3.28, 0)))
def test_a_crooked_scan_shows_reflectors_that_are_none(shape, rms, seen):
    """One reflector: one over optical frequency; over time several, or none in a smeared peak."""
    rng, delay, samples = np.random.default_rng(3), 4.67e-9, 2048
    branch = crooked_branch(shape, rms)
    even_time = np.linspace(branch.time[0], branch.time[-1], samples)
    swept = np.interp(even_time, branch.time, branch.frequency)
    in_time = np.cos(2 * np.pi * swept * 1e9 * delay) + 0.05 * rng.standard_normal(samples)
    step = float(even_time[1] - even_time[0])
    assert find_reflectors(in_time, step).count == seen
    nu = np.linspace(swept[0], swept[-1], samples)
    resampled = np.cos(2 * np.pi * nu * 1e9 * delay) + 0.05 * rng.standard_normal(samples)
    found = find_reflectors(resampled, abs(float(nu[1] - nu[0])) * 1e9)
    assert found.count == 1
    assert abs(found.delay_s[0] - delay) < 5 * found.delay_stderr_s[0]


def test_samples_that_cannot_be_are_refused():
    with pytest.raises(DataError, match="at least 64 finite numbers"):
        find_reflectors(np.zeros(30), 1.0)
    with pytest.raises(DataError, match="between 0 and 1"):
        find_reflectors(np.zeros(100), 1.0, false_alarm=2.0)
    assert find_reflectors(np.random.default_rng(0).standard_normal(100), 1.0).count == 0
