"""Turns where a fringe is at its extreme: the interferometer alone does not show them."""

import numpy as np
import pytest

from rapi_jax._waveform import triangle
from rapi_jax.readout import Fringes, read_fringes

HZ = 20.0
DELAY = 24.5e-9  # s
RATE = 1e6  # samples a second


def folded(t, lag=0.0):
    """An ideal triangle from 0 to 1 and back, late by `lag` (s)."""
    phase = np.mod((t - lag) * HZ, 1.0)
    return np.where(phase < 0.5, 2 * phase, 2 - 2 * phase)


def read(span, *, lag=0.0, cavity=False, noise=0.02, start=0.013, periods=2):
    t = start + np.arange(round(periods / HZ * RATE)) / RATE
    ghz = span * folded(t, lag)
    rng = np.random.default_rng(3)
    light = 2.5 + 2.0 * np.cos(2 * np.pi * ghz * 1e9 * DELAY) + noise * rng.standard_normal(t.size)
    peaks = 1.0 / (1.0 + 4e3 * np.sin(np.pi * (ghz + 0.4) / 1.5) ** 2) if cavity else None
    fringes = Fringes(light, peaks, sample_hz=RATE, start_s=start, delay_s=DELAY)
    readout = read_fringes(fringes, triangle(HZ, amplitude=4.0, bias=3.0, samples=2000)[0])
    error = readout.frequency - np.interp(readout.time, t, ghz)
    return readout, error - error.mean()


def off(readout, lag=0.0):
    """How far each turn is from the nearest true one, s."""
    time = np.array([turn.time_s for turn in readout.turns]) - lag
    return time - np.round(time * 2 * HZ) / (2 * HZ)


def said(readout):
    return [fault for fault in readout.faults if "does not show" in fault or "do not" in fault
            or "none of the laser's turns" in fault]  # fmt: skip


def test_none_of_the_turns_shows():
    readout, error = read(75.0)  # 3675 half fringes: both ends are extremes
    assert len(readout.turns) == 4
    assert np.abs(off(readout)).max() < 1e-6
    assert np.sqrt(np.mean(error**2)) < 1e-3
    assert len(said(readout)) == 1
    assert "none of the laser's turns" in said(readout)[0]
    assert all(turn.stderr_s > 1e-3 for turn in readout.turns)


@pytest.mark.parametrize("lag", [0.0, 3e-4])
def test_a_turn_between_two_that_show(lag):
    readout, error = read(74.3, lag=lag)  # the lower turn alone is at an extreme
    assert np.abs(off(readout, lag)).max() < 1e-6
    assert np.sqrt(np.mean(error**2)) < 1e-3
    assert "2 of 4" in said(readout)[0]
    seconds, stderr = readout.latency(triangle(HZ, amplitude=4.0, bias=3.0, samples=2000)[0])
    assert abs(seconds - lag) < 1e-6
    assert stderr < 1e-6


def test_a_cavity_tells():
    readout, error = read(75.0, lag=3e-4, cavity=True)
    assert not said(readout)
    assert np.abs(off(readout, 3e-4)).max() < 1e-6
    assert np.sqrt(np.mean(error**2)) < 1e-3


def test_a_late_laser_whose_turns_are_hidden_is_said_to_be_unknown():
    readout, _ = read(75.0, lag=3e-4)
    assert all(turn.stderr_s > 3e-4 for turn in readout.turns)
    _, stderr = readout.latency(triangle(HZ, amplitude=4.0, bias=3.0, samples=2000)[0])
    assert stderr > 3e-4


def test_turns_beside_an_extreme_show():
    readout, error = read(75.0 + 0.002, noise=0.0)  # ends 0.05 of a fringe beside extremes
    assert "none" not in " ".join(readout.faults)
    assert np.abs(off(readout)).max() < 1e-6


def test_a_turn_at_the_first_sample_is_no_fault():
    readout, _ = read(74.15, start=0.0, noise=0.02)
    assert not [fault for fault in readout.faults if "record's edge" in fault]
