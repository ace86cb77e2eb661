"""Noise as a sum of processes: known autocovariances, and variances found again in residuals."""

import numpy as np
import pytest
from scipy.signal import lfilter

from fitting.noise import (
    NoiseModel,
    PowerBins,
    Processes,
    RunLines,
    estimate_noise,
    estimate_shared_noise,
    excess_probability,
)
from fitting.noise._robust import median_of_exponentials

SIZE, STEP = 2000, 1e-3


def relaxation(rng, corner_hz, size=SIZE, step=STEP):
    """AR(1) noise of variance 1, stationary from its first sample."""
    rho = np.exp(-2.0 * np.pi * corner_hz * step)
    white = rng.standard_normal(size)
    white[0] /= np.sqrt(1.0 - rho**2)
    return lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white)


def smooth_columns(size=SIZE, count=6, runs=1):
    """Polynomials of the run, orthonormal over all runs."""
    t = np.linspace(-1.0, 1.0, size)
    one = np.stack([t**k for k in range(count)], axis=1)
    return np.split(np.linalg.qr(np.concatenate([one] * runs))[0], runs)


def left_by(columns, series):
    """What a fit of the columns, orthonormal over all runs, leaves of each run."""
    solved = sum(c.T @ s for c, s in zip(columns, series, strict=True))
    return [s - c @ solved for c, s in zip(columns, series, strict=True)]


def test_autocovariance_and_periodogram_are_those_of_each_process():
    processes = Processes.of([STEP], [SIZE])
    gamma = processes.autocovariance(STEP, SIZE)
    lag = STEP * np.arange(SIZE)
    np.testing.assert_allclose(gamma[:, 0], 1.0, rtol=1e-12)
    assert not gamma[0, 1:].any()
    np.testing.assert_allclose(gamma[3], np.exp(-2 * np.pi * processes.corner_hz[2] * lag))
    # the trace of a covariance matrix does not depend on the basis
    lines = PowerBins.of(SIZE, STEP)
    totals = lines.sums(processes.periodogram(STEP, SIZE)).sum(axis=1)
    np.testing.assert_allclose(totals, SIZE, rtol=1e-9)
    waves = np.fft.rfft(np.eye(SIZE), axis=1) / np.sqrt(SIZE)
    whole = gamma[5][np.abs(np.subtract.outer(np.arange(SIZE), np.arange(SIZE)))]
    power = np.einsum("tk,tk->k", (whole @ waves).real, waves.real)
    power += np.einsum("tk,tk->k", (whole @ waves).imag, waves.imag)
    np.testing.assert_allclose(processes.periodogram(STEP, SIZE)[5], power, rtol=1e-6, atol=1e-9)


def test_flicker_noise_falls_as_its_exponent_says():
    processes = Processes.of([STEP], [1 << 14])
    power = processes.periodogram(STEP, 1 << 14)[-3]  # exponent 1
    # in the middle: a corner too few at the fast end takes 2.5 % from the second, 0.012 in all
    assert np.log(power[6] / power[48]) / np.log(8.0) == pytest.approx(1.0, abs=0.03)


@pytest.mark.parametrize(
    "white, slow, corner",
    [(1.0, 0.0, 1.0), (0.0, 1.0, 20.0), (0.7, 0.3, 6.0), (0.9, 0.1, 2.0)],
)
def test_variances_are_found_again_in_what_a_fit_leaves(white, slow, corner):
    """The median of 60 replicates, at lines of which the fit leaves nearly all.

    Slower ones, which are only known from the law of a process, are tested by the coverage of
    standard errors.
    """
    columns, bins = smooth_columns(), [PowerBins.of(SIZE, STEP)]
    lines, found = np.array([10, 30, 100, 700]), []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        noise = np.sqrt(white) * rng.standard_normal(SIZE)
        noise = noise + np.sqrt(slow) * relaxation(rng, corner)
        model = estimate_noise(left_by(columns, [noise]), columns, [1.0], bins)
        found.append(model.variance[0] @ model.processes.periodogram(STEP, SIZE)[:, lines])
    truth = Processes(np.array([corner]), np.array([[1.0, 0.0], [0.0, 1.0]]))
    expected = np.array([white, slow]) @ truth.periodogram(STEP, SIZE)[:, lines]
    np.testing.assert_allclose(np.median(found, axis=0), expected, rtol=0.15)


def test_runs_share_what_is_the_same_from_second_to_second_or_from_sample_to_sample():
    steps, rng = (1e-3, 2.5e-4), np.random.default_rng(5)
    columns = smooth_columns(runs=2)
    bins = [PowerBins.of(SIZE, step) for step in steps]
    in_time = [relaxation(rng, 10.0, step=step) for step in steps]
    by_sample = [relaxation(rng, 10.0, step=steps[0]) for _ in steps]
    found = estimate_noise(left_by(columns, in_time), columns, [1.0, 1.0], bins)
    assert found.step_s == steps
    found = estimate_noise(left_by(columns, by_sample), columns, [1.0, 1.0], bins)
    assert found.step_s == (min(steps),) * 2


def test_runs_of_different_noise_have_each_their_own():
    columns, rng = smooth_columns(runs=2), np.random.default_rng(6)
    series = [rng.standard_normal(SIZE), 5.0 * relaxation(rng, 5.0)]
    bins = [PowerBins.of(SIZE, STEP)] * 2
    found = estimate_noise(left_by(columns, series), columns, [1.0, 1.0], bins)
    assert found.autocovariance(0, 2)[1] < 0.1
    assert found.autocovariance(1, 2)[1] == pytest.approx(25.0 * 0.97, rel=0.3)
    np.testing.assert_allclose(np.sqrt(found.variance.sum(axis=1)), [1.0, 5.0], rtol=0.2)


def test_a_residual_of_zeros_has_no_noise():
    columns, bins = smooth_columns(), [PowerBins.of(SIZE, STEP)]
    found = estimate_noise([np.zeros(SIZE)], columns, [1.0], bins)
    assert not found.variance.any() and not found.autocovariance(0, 50).any()


def _excess(series, periods=8):
    phase = np.linspace(0.0, 2.0 * np.pi * periods, SIZE, endpoint=False)
    columns = [np.linalg.qr(np.stack([np.cos(phase), np.sin(phase), np.cos(2 * phase)], 1))[0]]
    residual = left_by(columns, [series])
    between, at = ([PowerBins.of(SIZE, STEP, periods, pick)] for pick in ("between", "harmonics"))
    noise = estimate_noise(residual, columns, [1.0], between)
    return excess_probability(noise, residual, columns, [1.0], at, between)


@pytest.mark.parametrize("slow", [0.0, 0.3])
def test_noise_alone_is_an_excess_at_harmonics_as_often_as_its_level_says(slow):
    found = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        noise = rng.standard_normal(SIZE) + np.sqrt(slow) * relaxation(rng, 20.0)
        found.append(_excess(noise))
    assert np.mean(np.array(found) < 0.05) <= 0.10  # of 200; 0.05 + 3 standard deviations
    assert np.mean(np.array(found) < 0.001) <= 0.015


def test_what_repeats_is_an_excess_at_harmonics():
    phase = np.linspace(0.0, 16.0 * np.pi, SIZE, endpoint=False)
    noise = np.random.default_rng(1).standard_normal(SIZE)
    assert _excess(noise + 0.3 * np.sin(5 * phase)) < 1e-6
    assert _excess(noise) > 0.01


def test_a_model_is_shared_by_what_reads_it():
    processes = Processes.of([STEP], [SIZE])
    variance = np.zeros((1, processes.shares.shape[0]))
    variance[0, :2] = 0.5, 0.25
    model = NoiseModel(processes, variance, (STEP,))
    assert model.autocovariance(0, 1)[0] == pytest.approx(0.75)


def test_the_spectrum_of_a_process_is_its_periodogram_in_a_long_record():
    processes = Processes.of([STEP], [SIZE])
    size = 1 << 17
    line = np.array([50, 500, 5000, 60000])
    near = processes.spectrum(line / (size * STEP), STEP)
    np.testing.assert_allclose(processes.periodogram(STEP, size)[:, line], near, rtol=0.05)
    # over all frequencies it is the variance, 1
    every = processes.spectrum(np.fft.fftfreq(size, STEP), STEP)
    np.testing.assert_allclose(every.mean(axis=1), 1.0, rtol=1e-6)


def test_picked_processes_are_the_same():
    processes = Processes.of([STEP], [SIZE])
    these = np.array([0, 4, processes.shares.shape[0] - 2])
    few, whole = processes.pick(these), processes.periodogram(STEP, SIZE)
    # A product of matrices rounds its sums by their largest terms, and in another order.
    rounding = 1e-15 * whole.max()
    np.testing.assert_allclose(few.periodogram(STEP, SIZE), whole[these], rtol=1e-12, atol=rounding)
    assert processes.pick(np.array([0, 4])).corner_hz.size == 1


def test_the_median_of_exponentials():
    """By integration over the distribution of the middle of an odd number; by hand for few."""
    assert [median_of_exponentials(n) for n in (1, 2, 3)] == pytest.approx([1.0, 1.0, 5 / 6])
    drawn = np.random.default_rng(0).exponential(size=(200_000, 6))
    assert np.median(drawn, axis=1).mean() == pytest.approx(median_of_exponentials(6), rel=0.005)
    assert median_of_exponentials(100_001) == pytest.approx(np.log(2.0), abs=1e-5)


@pytest.mark.parametrize("tone", [0.0, 3.0])
@pytest.mark.parametrize(
    "white, slow, corner", [(1.0, 0.0, 1.0), (0.7, 0.3, 12.0), (0.5, 2.0, 60.0)]
)
def test_noise_that_runs_share_is_found_beside_a_tone(white, slow, corner, tone):
    """The median of 40 sessions of two runs; each with a tone of 30 and 60 Hz, or without."""
    every = {SIZE: STEP, 1200: 0.5 * STEP}
    at = np.array([12, 40, 150, 580])
    truth = Processes(np.array([corner]), np.eye(2))
    found = []
    for seed in range(40):
        runs = []
        for size, step in every.items():
            rng = np.random.default_rng([seed, size])
            noise = np.sqrt(white) * rng.standard_normal(size)
            noise += np.sqrt(slow) * relaxation(rng, corner, size, step)
            for hz in (30.0, 60.0):
                noise += tone * np.sin(2 * np.pi * hz * step * np.arange(size))
            line = np.arange(6, size // 2)
            runs.append(RunLines(step, size, line, np.abs(np.fft.rfft(noise)[line]) ** 2 / size))
        processes, variance = estimate_shared_noise(runs)
        assert processes.shares.shape[0] == variance.size <= 4
        found.append([variance @ processes.periodogram(h, n)[:, at] for n, h in every.items()])
    expected = [np.array([white, slow]) @ truth.periodogram(h, n)[:, at] for n, h in every.items()]
    np.testing.assert_allclose(np.median(found, axis=0), expected, rtol=0.2)
