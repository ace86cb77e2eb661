"""Branches of drives that do not repeat, and regions of interest."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from periodic_drives import BIN, periodic, triangle_at

from rapi_jax import DataError, Drive, Run
from rapi_jax.io import read_recording
from rapi_jax.sampling._phase import fold, turning_samples


def brute_turns(value, dead):
    """Turning samples by their meaning: alternate extremes, each left by more than `dead`."""
    turns, at = [], 0
    way = 0
    for i in range(value.size):
        part = value[at : i + 1]
        fell, rose = part.max() - value[i] > dead, value[i] - part.min() > dead
        if way >= 0 and fell:
            turns += [at + int(part.argmax())] if way else []
            at, way = (at + int(part.argmax()) if way else i), -1
        elif way <= 0 and rose:
            turns += [at + int(part.argmin())] if way else []
            at, way = (at + int(part.argmin()) if way else i), 1
    return turns


@settings(max_examples=100)
@given(st.lists(st.integers(-20, 20), min_size=3, max_size=40))
def test_turning_samples_are_the_extremes_between_real_moves(numbers):
    value = np.array(numbers, dtype=float)
    turns = turning_samples(value, 0.2)
    expected = {0, value.size - 1, *brute_turns(value, 0.2 * np.ptp(value))}
    assert sorted(expected) == list(turns)


def test_turning_samples_of_a_wave_and_of_noise_on_it():
    wave = -np.cos(2 * np.pi * np.arange(1001) / 200)
    assert list(turning_samples(wave)) == list(range(0, 1001, 100))
    noisy = wave + 0.003 * np.random.default_rng(0).uniform(-1, 1, 1001)
    # Near an extreme a cosine is flat to the noise over 0.011 of its period.
    assert np.abs(turning_samples(noisy) - np.arange(0, 1001, 100)).max() <= 5
    assert list(turning_samples(np.ones(9))) == [0, 8]


def test_branches_of_a_decaying_drive():
    time = np.arange(3000) / 1000
    value = np.exp(-time) * -np.cos(2 * np.pi * 2 * time)
    drive = Drive(time, value)
    slope = np.gradient(value)
    clear = np.abs(slope) > 0.1 * np.abs(slope).max()
    assert np.array_equal(drive.up[clear], slope[clear] > 0)
    place = Run(drive, value).along
    assert place.min() == 0.0 and place.max() == 1.0
    for begin, end in ((0, 240), (250, 490)):  # it turns at 243.7 and 493.7
        assert (np.diff(place[begin:end]) > 0).all()


def test_phase_of_a_free_drive_follows_its_branches():
    time = np.arange(301) / 100
    drive = Drive(time, np.abs(time - 1.0))  # down for 1 s, up for 2 s
    assert np.allclose(drive.phase[50], 0.75) and np.allclose(drive.phase[200], 0.25)
    assert not drive.up[50] and drive.up[200]


@pytest.mark.parametrize(
    "name", ["picma_1hz", "picma_small_loops", "afm_z_open_loop", "afm_z_closed_loop", "servo_lag"]
)
def test_branches_of_measured_drives(shared_data, name):
    """Wherever a measured drive clearly moves, it is on the branch of that direction."""
    for run in read_recording(shared_data / name).runs:
        value = run.drive.value
        width = max(3, value.size // 400)
        kernel = np.ones(2 * width + 1) / (2 * width + 1)
        slope = np.gradient(np.convolve(np.pad(value, width, "edge"), kernel, "valid"))
        clear = np.abs(slope) > 0.2 * np.abs(slope).max()
        # A mean over 1/200 of the record smears each turn by about as much.
        assert np.mean((slope > 0) == run.drive.up, where=clear) > 0.98
        assert 0.75 < run.roi.mean() < 0.85


@pytest.mark.parametrize("lag", [0.0, 0.1])
def test_the_region_of_interest_is_between_the_responses_turning_points(lag):
    drive = periodic(1600, 400.0)
    cycles = np.arange(1600) / 400 - lag
    run = Run(drive, 7.0 * triangle_at(cycles))
    along = np.mod(cycles, 0.5) / 0.5
    clear = (np.abs(along - 0.1) > 4 * BIN) & (np.abs(along - 0.9) > 4 * BIN)
    inside = (along > 0.1) & (along < 0.9)
    assert np.array_equal(run.roi[clear], inside[clear])
    assert run.roi.mean() == pytest.approx(0.8, abs=4 * BIN)
    assert run.span == pytest.approx(28.0)


def test_masked_readings_do_not_move_the_region():
    drive = periodic(1600, 400.0)
    response = 7.0 * drive.value
    masked = np.where(np.arange(1600) % 7 == 3, np.nan, response)
    assert np.array_equal(Run(drive, masked).roi, Run(drive, response).roi)
    assert Run(drive, masked).valid.sum() == np.isfinite(masked).sum() < 1600


def test_a_region_without_any_reading_is_refused():
    with pytest.raises(DataError, match="run 'empty'.*no reading"):
        _ = Run(periodic(800, 400.0), np.full(800, np.nan), "empty").roi


def test_folding_carries_over_bins_without_samples():
    phase = np.array([0.05, 0.15, 0.55])
    assert np.isfinite(fold(phase, np.array([1.0, 2.0, 3.0]), 10)).all()
    assert np.allclose(fold(phase, np.array([4.0, np.nan, 4.0]), 10), 4.0)
