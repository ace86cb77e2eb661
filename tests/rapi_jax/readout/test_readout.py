"""Fringes back to frequency, against a generator that shares no code with the reader."""

import numpy as np
import pytest
from fringe_world import DELAY, FSR, RATE, lagged, record, scan

from rapi_jax import DataError, predict
from rapi_jax._waveform import sine, triangle
from rapi_jax.examples import paper_device
from rapi_jax.readout import Fringes, read_fringes

FULL = (-2048.0, 2047.0)


def drive_at(hz):
    return triangle(hz, amplitude=4.5, bias=3.0)[0]


def read(rec, hz, *, cavity=True, delay=24.3e-9, drive=None):
    fringes = Fringes(
        rec.interferometer, rec.cavity if cavity else None, RATE, rec.start, delay, FSR, FULL
    )
    return read_fringes(fringes, drive_at(hz) if drive is None else drive)


def error_of(readout, curve):
    error = readout.frequency - curve(readout.time)
    return error - np.median(error)


def true_turn(curve, turn, width=2e-5):
    grid = turn.time_s + np.linspace(-width, width, 20001)
    value = curve(grid) * (-1.0 if turn.rising_after else 1.0)
    return float(grid[np.argmax(value)])


def beside_turns(readout, hz, fringes=3.0):
    """Whether each value is within so many mean fringes of a turn."""
    mean = 0.5 / hz / (75.0 * DELAY * 1e9)
    near = np.zeros(readout.time.size, dtype=bool)
    for turn in readout.turns:
        near |= np.abs(readout.time - turn.time_s) < fringes * mean
    return near


@pytest.mark.parametrize("hz", [10.0, 20.0, 30.0, 40.0])
@pytest.mark.parametrize("lag", [0.0, 1e-4, 1e-3])
def test_frequency_and_latency(hz, lag):
    curve = scan(hz, lag=lag)
    start = 0.2 / hz
    rec = record(curve, start, start + 1.0 / hz, seed=int(hz + 1e5 * lag))
    readout = read(rec, hz)
    error, near = error_of(readout, curve), beside_turns(readout, hz)
    assert not readout.faults
    assert np.std(error[~near]) < 2e-4  # GHz: 0.2 MHz
    assert np.sqrt(np.mean((error / readout.stderr)[~near] ** 2)) < 1.3
    assert np.sqrt(np.mean((error / readout.stderr)[near] ** 2)) < 3.0
    assert len(readout.turns) == 2
    assert all(turn.checked for turn in readout.turns)
    seconds, stderr = readout.latency(drive_at(hz))
    assert stderr < 1e-7
    assert abs(seconds - lag) < 3 * stderr
    assert abs(readout.delay_s - DELAY) < 4 * readout.delay_stderr_s
    assert readout.delay_stderr_s < 2e-5 * DELAY


@pytest.mark.slow
def test_turn_errors_are_honest():
    z, count = [], 0
    for seed in range(24):
        rng = np.random.default_rng(seed)
        hz, lag = 100.0, rng.uniform(0, 2e-4)
        slopes = tuple(rng.uniform((0.8, 1.2, 0.4, 1.0), (1.2, 2.0, 1.0, 1.8)))
        curve = scan(hz, slopes=slopes, lag=lag)
        middle = 0.005 + lag
        readout = read(record(curve, middle - 1.5e-3, middle + 1.5e-3, seed=seed), hz)
        assert len(readout.turns) == 1, seed
        turn = readout.turns[0]
        z.append((turn.time_s - middle) / turn.stderr_s)
        count += abs(z[-1]) < 2
    assert count >= 20  # of 24, by chance 23
    assert np.sqrt(np.mean(np.square(z))) < 1.6


@pytest.mark.parametrize("tau", [2e-6, 2e-5, 2e-4, 1e-3])
@pytest.mark.parametrize("hz", [10.0, 40.0])
def test_rounded_corners(hz, tau):
    curve = lagged(scan(hz), tau, hz)
    readout = read(record(curve, 0.2 / hz, 1.2 / hz, seed=3), hz)
    error = error_of(readout, curve)
    assert not readout.faults
    assert np.abs(error).max() < 3e-3  # a fringe is 41 MHz
    for turn in readout.turns:
        off = abs(turn.time_s - true_turn(curve, turn))
        assert off < 4 * turn.stderr_s + 1e-7
        assert off < 0.02 * tau + 2e-7


@pytest.mark.parametrize("seed", range(12))
def test_any_scan(seed):
    rng = np.random.default_rng(100 + seed)
    hz = float(rng.choice([30.0, 40.0, 100.0]))
    slopes = tuple(rng.uniform((0.8, 1.0, 0.3, 1.0), (1.5, 2.2, 1.3, 2.0)))
    lag, tau = rng.choice([0.0, 1e-6, 1e-4, 3e-4]), rng.choice([0.0, 2e-6, 2e-5, 2e-4])
    curve = scan(hz, slopes=slopes, lag=lag, span=rng.uniform(60, 80))
    curve = lagged(curve, tau, hz) if tau else curve
    start = rng.uniform(0.05, 0.4) / hz
    rec = record(curve, start, start + 1.0 / hz, seed=seed, linewidth=rng.choice([0, 2e5, 1e6]))
    readout = read(rec, hz)
    error = error_of(readout, curve)
    assert np.abs(error).max() < 4e-3
    assert np.std(error) < 4e-4
    assert len(readout.turns) == 2
    assert not any("wrong fringe" in fault for fault in readout.faults)


def test_the_paper_device():
    hz = 40.0
    drive = triangle(hz, amplitude=4.5, bias=3.0, samples=80_000)[0]
    answer = np.asarray(predict(paper_device(), drive))

    def curve(t):
        return np.interp(np.mod(t, 1 / hz), drive.time, answer, period=1 / hz)

    coarse = drive_at(hz)
    readout = read(record(curve, 0.3 / hz, 1.5 / hz, seed=5), hz, drive=coarse)
    assert not readout.faults
    error = error_of(readout, curve)
    assert np.std(error) < 2e-4
    run = readout.run(coarse, name="paper")
    truth = curve(coarse.time)
    residual = run.response - truth
    residual -= np.median(residual)
    assert run.name == "paper"
    assert np.std(residual) < 1e-4
    assert np.abs(residual).max() < 1e-3  # the corners too
    assert readout.run(coarse, samples=1000).drive.size == 1000


def test_without_a_cavity():
    hz = 40.0
    for seed, lag in enumerate([0.0, 1e-4, 1e-3]):
        curve = scan(hz, lag=lag)
        rec = record(curve, 0.2 / hz, 1.2 / hz, seed=seed)
        readout = read(rec, hz, cavity=False, delay=DELAY)
        assert np.abs(error_of(readout, curve)).max() < 3e-3
        assert readout.delay_s == DELAY
        assert np.isinf(readout.delay_stderr_s)
        assert readout.peaks.size == 0
        seconds, stderr = readout.latency(drive_at(hz))
        assert abs(seconds - lag) < 4 * stderr


def test_a_slow_round_turn():
    hz = 40.0
    drive = sine(hz, amplitude=4.5, bias=3.0)[0]

    def curve(t):
        return 37.5 * (1 - np.cos(2 * np.pi * hz * (t - 5e-5)))

    readout = read(record(curve, 0.2 / hz, 1.2 / hz, seed=1), hz, drive=drive)
    assert np.abs(error_of(readout, curve)).max() < 3e-3
    seconds, stderr = readout.latency(drive)
    assert abs(seconds - 5e-5) < 4 * stderr


def test_a_record_that_starts_elsewhere_is_read_on_the_drives_samples():
    hz = 40.0
    curve = scan(hz)
    readout = read(record(curve, 0.7 / hz, 1.8 / hz, seed=2), hz)
    response = readout.run(drive_at(hz)).response
    assert np.isfinite(response).all()
    residual = response - curve(drive_at(hz).time)
    assert np.abs(residual - np.median(residual)).max() < 2e-3


def test_no_turn_no_latency():
    curve = scan(10.0)
    readout = read(record(curve, 0.010, 0.030, seed=2), 10.0)
    assert not readout.turns
    assert np.abs(error_of(readout, curve)).max() < 3e-3
    with pytest.raises(DataError, match="no latency"):
        readout.latency(drive_at(10.0))


def test_records_that_cannot_be_read():
    with pytest.raises(DataError, match="no fringes"):
        noise = np.random.default_rng(0).standard_normal(200_000)
        read_fringes(Fringes(noise, None, RATE), drive_at(40.0))
    with pytest.raises(DataError, match="samples"):
        Fringes(np.zeros(1000), np.zeros(999), RATE)
    with pytest.raises(DataError, match="finite"):
        Fringes(np.full(1000, np.nan), None, RATE)
    with pytest.raises(DataError, match="positive"):
        Fringes(np.zeros(1000), None, -1.0)
