"""First guesses of a rounded drive where a lag is known: before it, and behind it."""

import numpy as np
import pytest

from rapi_jax import triangle
from rapi_jax.effects import Delay, Quantisation, ResidualSummary
from rapi_jax.effects.base._linear_path import LinearPath

RATES, SAMPLES, PERIODS, SLOPE, TAU = (7.0, 11.0), 900, 2, 20.0, 6e-4


def paths(transfer) -> LinearPath:
    """Of a session of `RATES`; `transfer`: of a frequency in Hz."""
    size = SAMPLES * PERIODS
    hertz = [np.fft.rfftfreq(size, 1.0 / (rate * SAMPLES)) for rate in RATES]
    return LinearPath(len(RATES) * (size,), tuple(map(transfer, hertz)))


LAG = paths(lambda hertz: 1.0 / (1.0 + 2j * np.pi * hertz * TAU))


def behind(path: LinearPath, change: np.ndarray) -> np.ndarray:
    """A change of the response as it is read."""
    parts = zip(np.split(change, np.cumsum(path.size)[:-1]), path.transfer, strict=True)
    return np.concatenate([np.fft.irfft(np.fft.rfft(x) * line, x.size) for x, line in parts])


def sent() -> np.ndarray:
    shape = {"amplitude": 4.0, "bias": 3.0, "samples": SAMPLES * PERIODS, "periods": PERIODS}
    return np.concatenate([drive.value for drive in triangle(list(RATES), **shape)])


def summary(drive: np.ndarray, residual: np.ndarray, places=()) -> ResidualSummary:
    step = [1.0 / (rate * SAMPLES) for rate in RATES]
    time = np.concatenate([np.arange(SAMPLES * PERIODS) * s for s in step])
    run = np.repeat(np.arange(len(RATES)), SAMPLES * PERIODS)
    return ResidualSummary(
        time, drive, SLOPE * drive, residual, run, RATES, (4.0, 4.0), min(step), 0.02, 80.0, places
    )


def is_found(evidence: ResidualSummary, rounded: np.ndarray, step: float, origin: float) -> bool:
    """Whether the staircase of a guess is nearer to the right one than the drive before is."""

    def staircase(step, origin):
        return origin + step * np.round((rounded - origin) / step)

    right = staircase(step, origin)
    return any(
        np.std(staircase(float(guess.step), float(guess.origin)) - right) < np.std(rounded - right)
        for guess in Quantisation.initial_guesses(evidence)
        if abs(float(guess.step) / step - 1.0) < 2e-3
    )


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("where", ["before", "behind"])
def test_a_staircase_is_found_where_it_is(where, seed):
    rng = np.random.default_rng(seed)
    step, drive = float(rng.uniform(0.03, 0.12)), sent()
    origin, lagging = float(rng.uniform(0.0, step)), behind(LAG, drive)
    rounded = drive if where == "before" else lagging
    change = SLOPE * (origin + step * np.round((rounded - origin) / step) - rounded)
    residual = behind(LAG, change) if where == "before" else change
    residual = residual + 0.02 * rng.standard_normal(drive.size)
    assert is_found(
        summary(drive, residual, ((drive, LAG), (lagging, None))), rounded, step, origin
    )
    if where == "behind":  # as a function of the drive that was sent it is no staircase
        assert not is_found(summary(drive, residual), rounded, step, origin)


@pytest.mark.parametrize("size", [(7,), (8, 5), (1, 6, 9)])
def test_a_path_and_its_adjoint_agree_on_every_product(size):
    rng = np.random.default_rng(len(size))
    lines = [rng.normal(size=n // 2 + 1) + 1j * rng.normal(size=n // 2 + 1) for n in size]
    for n, line in zip(size, lines, strict=True):
        line[0] = line[0].real
        line[-1] = line[-1].real if n % 2 == 0 else line[-1]
    path = LinearPath(size, tuple(lines))
    x, y = rng.normal(size=(2, sum(size)))
    assert y @ behind(path, x) == pytest.approx(path.adjoint(y) @ x, abs=1e-12)


def test_a_delay_by_whole_samples_turns_each_run():
    x = np.random.default_rng(0).normal(size=2 * SAMPLES * PERIODS)
    steps = [1.0 / (rate * SAMPLES) for rate in RATES]
    delays = [Delay.at(tau=3.0 * step) for step in steps]
    hertz = [np.fft.rfftfreq(SAMPLES * PERIODS, step) for step in steps]
    transfer = [delay.transfer(f) for delay, f in zip(delays, hertz, strict=True)]
    path = LinearPath(2 * (SAMPLES * PERIODS,), tuple(map(np.asarray, transfer)))
    expected = np.roll(x.reshape(2, -1), -3, axis=1).ravel()  # what came late is matched early
    np.testing.assert_allclose(path.adjoint(x), expected, atol=1e-6)
