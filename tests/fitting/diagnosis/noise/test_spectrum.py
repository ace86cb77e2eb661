"""Blocks of periods, and the noise read from them, against numbers written out by hand."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter
from silent import noise, session, usual_step

from fitting.diagnosis.noise._lines import SpectralLines, to_lines
from fitting.diagnosis.noise._periods import PeriodBlock, period_blocks
from fitting.diagnosis.noise._spectrum import Spectrum, measure_spectrum
from fitting.diagnosis.noise._whitening import Whitener
from fitting.noise import Processes
from rapi_jax import Drive, Recording
from rapi_jax.sampling._batch import to_batch


def relaxing(white: float, low: float, corner_hz: float, step_s: float) -> Spectrum:
    """White noise, and a relaxation whose slowest lines have the power `low`."""
    rho = np.exp(-2.0 * np.pi * corner_hz * step_s)
    variances = np.array([white, low * (1.0 - rho) / (1.0 + rho)])
    return Spectrum(Processes(np.array([corner_hz]), np.eye(2)), variances, True)


def test_blocks_hold_the_readings_of_whole_periods():
    """A record that begins and ends in mid-period: rows are equal pieces from the minimum on."""
    t = np.arange(1000) / 8000.0
    u = 3.0 - np.abs(2.0 * np.mod(t * 40.0 + 0.7, 1.0) - 1.0) * -2.0
    drive = Drive(t, u, excitation_hz=40.0, waveform="triangle", start_s=4.0)
    y = np.arange(1000.0)
    y[333] = np.nan
    recording = Recording.of([drive], [y])
    (block,) = period_blocks(recording, to_batch(recording, lead=True))
    assert block.repeats
    assert block.left.shape == (block.periods, 200)
    assert block.periods >= 4
    start = int(block.data[0, 0])
    value = start + np.arange(block.size).reshape(block.periods, 200)
    good = block.use > 0
    np.testing.assert_array_equal(block.data[good], value[good])
    np.testing.assert_array_equal(value[~good], [333])
    np.testing.assert_allclose(block.drive, u[value], atol=1e-12)
    np.testing.assert_allclose(block.time, 4.0 + value / 8000.0)
    assert np.abs(block.drive[0, :] - block.drive[1, :]).max() < 1e-9
    assert int(block.drive[0].argmin()) in (0, 1, 198, 199)


def test_periods_that_are_no_whole_numbers_of_samples_are_read_between_them():
    t = np.arange(1000) / 8000.0
    u = 3.0 - np.abs(2.0 * np.mod(t * 37.3, 1.0) - 1.0)
    drive = Drive(t, u, excitation_hz=37.3, waveform="triangle")
    recording = Recording.of([drive], [100.0 * t])
    (block,) = period_blocks(recording, to_batch(recording, lead=True))
    np.testing.assert_allclose(block.data, 100.0 * block.time, atol=1e-9)
    np.testing.assert_allclose(np.diff(block.time[:, 0]), 1 / 37.3, rtol=1e-9)


def test_a_run_that_does_not_repeat_is_one_row():
    t = np.arange(500) / 1000.0
    recording = Recording.of([Drive(t, np.sin(9 * t) + t)], [t])
    (block,) = period_blocks(recording, to_batch(recording, lead=True))
    assert (block.periods, block.repeats, block.size) == (1, False, 500)


def test_lines_split_what_repeats_from_what_does_not_exactly():
    """Parseval, and the period means: all of them in every fifth line, nothing of the rest."""
    _, (block,) = session(rates=(20.0,))
    e = np.random.default_rng(0).standard_normal(block.left.shape)
    lines, power = SpectralLines.of(block), np.abs(to_lines(e)) ** 2
    assert lines.multiplicity @ power == pytest.approx((e**2).sum(), rel=1e-12)
    mean = e.mean(axis=0)
    synchronous = float(lines.multiplicity[lines.synchronous] @ power[lines.synchronous])
    assert synchronous == pytest.approx(5 * float(mean @ mean), rel=1e-12)
    assert lines.hertz[lines.synchronous][1] == pytest.approx(20.0)


@pytest.mark.parametrize("low", [0.0, 3.0])
def test_the_spectrum_is_recovered(low: float):
    """Mean noise to 6 % on average over 30 sessions of 3120 readings; its form within 25 %."""
    _, parts = session()
    grid = np.array([40.0, 200.0, 1000.0])
    found = np.mean(
        [
            measure_spectrum(noise(np.random.default_rng(s), parts, low), parts).variance(
                grid, usual_step(parts)
            )
            for s in range(30)
        ],
        axis=0,
    )
    truth = (0.5 if low else 1.0) + low / (1.0 + (grid / 200.0) ** 2)
    np.testing.assert_allclose(found, truth, rtol=0.25)
    assert found[2] == pytest.approx(truth[2], rel=0.1)


def test_effects_hardly_move_the_spectrum():
    """What repeats not at all; drift and a tone, each 25 times the noise, by less than 15 %."""
    _, parts = session(phases=780)
    e = noise(np.random.default_rng(0), parts)
    clean = measure_spectrum(e, parts)
    synchronous = measure_spectrum(
        [x + 99 * np.cos(b.phase)[None, :] for x, b in zip(e, parts, strict=True)], parts
    )
    at, step = np.array([100.0]), usual_step(parts)
    assert synchronous.variance(at, step) == pytest.approx(clean.variance(at, step), rel=1e-6)
    moved = [x + 5 * np.sin(300 * b.time) + 50 * b.time for x, b in zip(e, parts, strict=True)]
    high = np.array([2000.0])
    assert measure_spectrum(moved, parts).variance(high, step) == pytest.approx(
        clean.variance(high, step), rel=0.15
    )


def test_one_period_makes_the_noise_unknown():
    _, parts = session(periods=1, phases=780)
    found = measure_spectrum(noise(np.random.default_rng(0), parts), parts)
    assert not found.measured
    assert found.white == pytest.approx(1.0, rel=0.15)


def test_no_noise_at_all_is_no_error():
    _, parts = session()
    found = measure_spectrum([np.zeros(b.left.shape) for b in parts], parts)
    assert 0 < found.white < 1e-200


def test_whitened_errors_have_unit_variance():
    _, parts = session()
    step = usual_step(parts)
    spectrum = relaxing(0.5, 3.0, 200.0, step)
    whitener = Whitener(parts, spectrum, False)

    def drawn(rng: np.random.Generator, b) -> np.ndarray:
        """White noise and AR(1) noise that is stationary from its first sample."""
        rho = np.exp(-2.0 * np.pi * 200.0 * b.step_s)
        white, slow = rng.standard_normal((2, b.size))
        slow[1:] *= np.sqrt(1.0 - rho**2)
        slow = np.sqrt(spectrum.variances[1]) * lfilter([1.0], [1.0, -rho], slow)
        return (np.sqrt(0.5) * white + slow).reshape(b.left.shape)

    e = [[drawn(np.random.default_rng([s, k]), b) for k, b in enumerate(parts)] for s in range(20)]
    synchronous, nonsynchronous = (np.stack(x) for x in zip(*map(whitener.whiten, e), strict=True))
    assert synchronous.shape[1] + nonsynchronous.shape[1] == sum(b.size for b in parts)
    assert np.mean(synchronous**2) == pytest.approx(1.0, rel=0.05)
    assert np.mean(nonsynchronous**2) == pytest.approx(1.0, rel=0.05)


def test_whitening_one_period_is_whitening_all():
    """And a run with its own zero has no mean."""
    _, parts = session()
    spectrum = relaxing(1.0, 2.0, 100.0, 1.0 / 1560.0)
    one = [np.random.default_rng(1).standard_normal((1, 156)) for _ in parts]
    every = [np.repeat(x, 5, axis=0) for x in one]
    whitener = Whitener(parts, spectrum, True)
    synchronous, nonsynchronous = whitener.whiten(every)
    np.testing.assert_allclose(whitener.whiten_mean_period(one), synchronous, atol=1e-10)
    np.testing.assert_allclose(nonsynchronous, 0.0, atol=1e-10)
    shifted = [x + 5.0 for x in every]
    np.testing.assert_allclose(whitener.whiten(shifted)[0], synchronous, atol=1e-10)


def test_masks_are_kept():
    _, parts = session(rates=(10.0,))
    assert parts[0].use.all()
    assert dataclasses.replace(parts[0], use=parts[0].use * 0).size == 780


def _two_samplings() -> list[PeriodBlock]:
    """Five periods of 5 Hz at 60 samples each, and one of 8 times as many samples a second."""
    _, slow = session(rates=(5.0,), periods=5, phases=60)
    _, fast = session(rates=(5.0,), periods=1, phases=480)
    return [*slow, *fast]


def _ratios(corner_hz: float | None, *, of_fit: bool) -> np.ndarray:
    """Power in quarters of the fast run's lines over what is expected: geometric mean, 60 sessions.

    A quarter holds 60 lines, a session's ratio so 0.13 of chance alone, the mean 0.02.
    """
    parts = _two_samplings()
    lines, found = SpectralLines.of(parts[-1]), []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        errors = [_drawn(rng, b, corner_hz) for b in parts]
        expected = measure_spectrum(errors, parts, of_fit=of_fit).of_lines(lines)
        power = np.abs(to_lines(errors[-1])) ** 2
        quarters = np.array_split(np.arange(1, power.size), 4)
        found.append([np.log(power[q].mean() / expected[q].mean()) for q in quarters])
    return np.exp(np.mean(found, axis=0))


@pytest.mark.parametrize("of_fit", [False, True])
def test_what_looks_white_in_runs_that_repeat_is_white_in_faster_ones(of_fit):
    """Not a relaxation that only a faster run could tell from it: then they are 0.6 to 2.2."""
    np.testing.assert_allclose(_ratios(None, of_fit=of_fit), 1.0, atol=0.1)


def test_noise_faster_than_runs_that_repeat_is_read_off_the_others():
    """It falls from 400 Hz on; the runs that repeat are sampled at 300 Hz, and see it as white."""
    np.testing.assert_allclose(_ratios(400.0, of_fit=True), 1.0, atol=0.2)
    assert _ratios(400.0, of_fit=False).max() > 1.5


def _drawn(rng: np.random.Generator, block: PeriodBlock, corner_hz: float | None) -> np.ndarray:
    fresh = rng.standard_normal(block.size)
    if corner_hz is None:
        return fresh.reshape(block.left.shape)
    rho = np.exp(-2.0 * np.pi * corner_hz * block.step_s)
    out = lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], fresh, zi=[rho * rng.standard_normal()])[0]
    return out.reshape(block.left.shape)


def test_what_a_fit_misses_fast_is_no_noise():
    """Jumps 40 times the noise in the run that does not repeat: the noise stays as measured."""
    parts = _two_samplings()
    for seed in range(5):
        rng = np.random.default_rng(seed)
        errors = [rng.standard_normal(b.left.shape) for b in parts]
        measured = measure_spectrum(errors, parts)
        errors[-1] += 40.0 * np.sign(np.sin(1.7 * np.arange(parts[-1].size)))
        found = measure_spectrum(errors, parts, of_fit=True)
        assert found.total == measured.total and found.total == pytest.approx(1.0, rel=0.4)
