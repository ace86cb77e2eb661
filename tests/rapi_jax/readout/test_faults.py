"""Each thing that goes wrong with a record is caught, said, and where possible mended."""

import numpy as np
from fringe_world import FSR, RATE, record, scan

from rapi_jax._waveform import triangle
from rapi_jax.readout import Fringes, read_fringes

HZ = 40.0
CURVE = scan(HZ)


def made(**options):
    return record(CURVE, 0.2 / HZ, 1.2 / HZ, seed=7, **options)


def read(rec, full=(-2048.0, 2047.0)):
    fringes = Fringes(rec.interferometer, rec.cavity, RATE, rec.start, 24.3e-9, FSR, full)
    return read_fringes(fringes, triangle(HZ, amplitude=4.5, bias=3.0)[0])


def error_of(readout):
    error = readout.frequency - CURVE(readout.time)
    return error - np.median(error)


def named(readout, *words):
    return [fault for fault in readout.faults if all(word in fault for word in words)]


def test_clipped_fringes():
    for full in ((-2048.0, 2047.0), None):
        readout = read(made(amplitude=2400.0), full)
        assert named(readout, "interferometer", "clipped")
        assert np.std(error_of(readout)) < 5e-4
        assert np.abs(error_of(readout)).max() < 5e-3


def test_clipped_peaks():
    rec = made()
    rec.cavity = np.minimum(rec.cavity, 0).astype(np.int16)
    readout = read(rec, None)
    assert named(readout, "cavity", "clipped")
    assert abs(readout.delay_s - 24.5e-9) < 5 * readout.delay_stderr_s


def test_missed_and_spurious_peaks():
    rec = made()
    whole = read(rec)
    assert not whole.faults
    lost, kept = whole.peaks.time_s[10], whole.peaks.size
    dark = np.abs(rec.time - lost) < 2e-5
    rec.cavity[dark] = -1000
    readout = read(rec)
    assert named(readout, "missed")
    assert readout.peaks.size == kept - 1
    between = (whole.peaks.time_s[20] + whole.peaks.time_s[21]) / 2
    shape = np.abs(whole.peaks.time_s[20] - rec.time) < 4e-6
    at = np.flatnonzero(shape)
    to = int(np.searchsorted(rec.time, between)) + np.arange(at.size)
    rec.cavity[to] = rec.cavity[at]  # a second transverse mode, as large as the first
    readout = read(rec)
    assert named(readout, "spurious")
    assert abs(readout.delay_s - 24.5e-9) < 4 * readout.delay_stderr_s


def test_a_spike_is_no_peak():
    rec = made()
    rec.cavity[100_000] = 800
    readout = read(rec)
    assert named(readout, "spike")
    assert readout.peaks.size == read(made()).peaks.size


def test_changing_visibility():
    readout = read(made(visibility=lambda t: 0.7 + 0.3 * np.sin(2 * np.pi * 60.0 * t)))
    assert named(readout, "visibility")
    assert np.abs(error_of(readout)).max() < 3e-3
    assert not named(readout, "wrong fringe")


def test_a_slipped_fringe():
    for slip in (0.008, 0.0165, 0.021):
        readout = read(made(slip_at=slip))
        assert named(readout, "wrong fringe", "mended")
        error = error_of(readout)
        far = np.abs(readout.time - slip) > 2e-4
        assert np.abs(error[far]).max() < 3e-3
        assert np.abs(error[~far] / readout.stderr[~far]).max() < 6


def test_no_peaks():
    rec = made()
    rec.cavity[:] = (-1000 + 10 * np.random.default_rng(0).standard_normal(rec.time.size)).astype(
        np.int16
    )
    readout = read(rec)
    assert named(readout, "cavity", "no peaks")
    assert np.isinf(readout.delay_stderr_s)
