"""Delayed drives, and waveforms."""

import numpy as np
import pytest
from periodic_drives import periodic, triangle_at

from rapi_jax import DataError, Drive, Recording
from rapi_jax._waveform import multisine, sine, step_and_hold, triangle
from rapi_jax.examples import paper_drives

TIME = np.arange(20) * 0.01


@pytest.mark.parametrize("lag", [0.3, 1.0, 2.5, 20.0, 100.0, 130.0])
@pytest.mark.parametrize("minimum", [0.0, 0.23])
@pytest.mark.parametrize("periods", [1, 3])
def test_a_periodic_drive_is_delayed_round_its_period(lag, minimum, periods):
    """`lag` in samples, 100 a period; an interpolated triangle is exact but next to its turns."""
    drive = periodic(100 * periods, 100.0, minimum)
    if lag >= 50.0 * periods:
        with pytest.raises(DataError, match="`response_lag_s`"):
            drive.delayed(lag * drive.step_s)
        return
    delayed = drive.delayed(lag * drive.step_s)
    cycles = (np.arange(100 * periods) - lag) / 100.0
    turns = np.abs(np.mod(2 * (cycles - minimum) + 0.5, 1.0) - 0.5) < 0.021
    error = np.abs(delayed.value - triangle_at(cycles, minimum))
    assert error[~turns].max() <= 1e-12
    assert error.max() <= 0.5 * 8.0 / 100.0  # half of one sample's step
    assert (delayed.rate, delayed.waveform) == (drive.rate, drive.waveform)
    assert np.array_equal(delayed.time, drive.time)


def test_a_free_drive_is_delayed_from_where_it_rested():
    drive = Drive(TIME, TIME**2)
    delayed = drive.delayed(0.03)
    assert np.allclose(delayed.value, np.maximum(TIME - 0.03, 0.0) ** 2, atol=1e-15)
    assert drive.delayed(0.0) is drive
    for lag in (-0.01, 0.2):
        with pytest.raises(DataError, match="`response_lag_s`"):
            drive.delayed(lag)


def test_the_lag_is_not_taken_from_what_is_kept():
    drive = periodic(100, 100.0)
    recording = Recording.of([drive], [drive.value], response_lag_s=0.002)
    assert np.array_equal(recording.runs[0].drive.value, drive.value)


@pytest.mark.parametrize("samples, periods", [(4000, 1), (999, 3), (1000, 3)])
@pytest.mark.parametrize("make", [triangle, sine, multisine])
def test_waveforms_start_at_their_minimum_and_have_the_range_asked_for(make, samples, periods):
    drives = make((5.0, 20.0), amplitude=3.0, bias=-1.0, samples=samples, periods=periods)
    assert [d.rate for d in drives] == [5.0, 20.0]
    assert [d.start_s for d in drives] == [0.0, periods / 5.0]  # one after the other
    for drive in drives:
        assert drive.waveform == make.__name__ and drive.size == samples
        assert drive.step_s == pytest.approx(periods / drive.rate / samples)
        # The multisine's extremes are known from 8192 points of its period: to 1e-4 of its range.
        tolerance = 1e-12 if make is not multisine else 3e-4
        assert drive.value[0] == pytest.approx(-2.5, abs=tolerance)
        assert drive.value.min() >= -2.5 - tolerance
        assert drive.value.max() <= 0.5 + tolerance
        # A sample lies within half a step of the top: a triangle is steepest of the three there,
        # 2 amplitude / per_period a step, or a multisine by its curvature, less than that.
        assert drive.value.max() >= 0.5 - 3.0 * periods / samples
        assert drive.periods == periods


def test_waveforms_hold_the_frequencies_they_say():
    spectrum = [
        np.abs(np.fft.rfft(make(10.0, amplitude=2.0, bias=0.0, samples=800)[0].value)) / 400
        for make in (sine, triangle, multisine)
    ]
    assert spectrum[0][1] == pytest.approx(1.0) and np.delete(spectrum[0], 1).max() < 1e-12
    # The series of a triangle, with aliases of some 1 / 800^2.
    assert np.allclose(spectrum[1][1:8:2], 8 / np.pi**2 / np.arange(1, 8, 2) ** 2, atol=1e-5)
    lines = spectrum[2]
    assert np.allclose(lines[[1, 2, 3, 5]], lines[1]) and lines[1] > 0.1
    assert np.delete(lines, [0, 1, 2, 3, 5]).max() < 1e-12


def test_the_papers_drives():
    drives = paper_drives()
    assert [d.rate for d in drives] == [10.0, 20.0, 30.0, 40.0]
    assert all(d.u_pp == 4.5 and d.value.min() == 0.75 and d.waveform == "triangle" for d in drives)


def test_step_and_hold_holds_and_ramps():
    (drive,) = step_and_hold((1.0, 4.0, 2.0), hold_s=0.5, rise_s=0.1, step_s=0.01)
    assert drive.waveform == "step" and drive.rate == 0.0 and drive.step_s == pytest.approx(0.01)
    levels = {0.0: 1.0, 0.49: 1.0, 0.55: 2.5, 0.6: 4.0, 1.09: 4.0, 1.15: 3.0, 1.2: 2.0, 1.69: 2.0}
    for t, level in levels.items():
        assert drive.value[round(t / 0.01)] == pytest.approx(level, abs=1e-9)
    assert drive.time[-1] < 1.7 <= drive.time[-1] + 0.0101


@pytest.mark.parametrize("make", [triangle, sine, multisine])
@pytest.mark.parametrize(
    "change, name",
    [
        (dict(samples=7), "samples"),
        (dict(samples=100, periods=13), "samples"),
        (dict(periods=0), "periods"),
        (dict(frequencies=0.0), "frequencies"),
        (dict(frequencies=(10.0, -1.0)), "frequencies"),
    ],
)
def test_waveforms_refuse(make, change, name):
    with pytest.raises(ValueError, match=f"`{name}`"):
        make(**{**dict(frequencies=10.0, amplitude=1.0, bias=0.0), **change})


@pytest.mark.parametrize(
    "change", [dict(levels=(1.0,)), dict(hold_s=0.0), dict(rise_s=-1.0), dict(step_s=0.0)]
)
def test_step_and_hold_refuses(change):
    with pytest.raises(ValueError, match="`step_and_hold`"):
        step_and_hold(**{**dict(levels=(0.0, 1.0), hold_s=1.0, rise_s=1.0, step_s=0.1), **change})
