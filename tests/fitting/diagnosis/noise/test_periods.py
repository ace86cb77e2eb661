"""Whole periods of a run, cut and thinned, against indices written out by hand."""

import dataclasses

import numpy as np
import pytest
from edge_worlds import drives, wandering

from fitting.diagnosis.noise._periods import PeriodBlock, decimate, period_blocks, slice_block
from rapi_jax import Drive, Recording
from rapi_jax.sampling._batch import to_batch


def block_of(drive: Drive, response: np.ndarray) -> PeriodBlock:
    recording = Recording.of([drive], [response])
    return period_blocks(recording, to_batch(recording, lead=True))[0]


def counted(drive: Drive) -> PeriodBlock:
    """The block of a run whose readings are their own indices."""
    return block_of(drive, np.arange(drive.size, dtype=float))


@pytest.mark.parametrize("phase", [0.0, 0.01, 0.25, 0.37, 0.5, 0.75, 0.995])
def test_rows_begin_at_the_minimum_wherever_a_run_begins(phase):
    (drive,) = drives((10.0,), periods=4.6, phase=phase)
    block = counted(drive)
    first = int(block.data[0, 0])
    # A bin of the phase (1/200) off, or the 1.5 % within which a record begins with its period.
    away = (drive.value[first] - drive.value.min()) / 3.0 / 2.0
    assert away <= (0.015 if first == 0 else 0.005) + 1e-9
    assert block.periods == (drive.size - first) // 200
    np.testing.assert_array_equal(block.data.ravel(), first + np.arange(block.size))
    np.testing.assert_allclose(block.drive, drive.value[block.data.astype(int)], atol=1e-12)
    np.testing.assert_allclose(block.phase, np.arange(200) / 200)
    assert block.step_s == pytest.approx(1 / 2000)


@pytest.mark.parametrize("samples", [200.37, 37.9, 199.5, 64.001])
def test_periods_between_samples_are_read_there(samples):
    """A parabola read by straight lines is at most an eighth of the second difference off."""
    (drive,) = drives((10.0,), periods=5.3, samples=samples)
    block = block_of(drive, drive.time**2)
    want = block.time**2
    assert block.periods >= 4
    assert np.abs(block.data - want).max() <= 2 * drive.step_s**2 / 8 * (1 + 1e-9)
    assert np.ptp(np.diff(block.time, axis=0)) < 1e-12  # rows are one period apart
    np.testing.assert_allclose(np.diff(block.time, axis=0), 0.1, rtol=0.02 / samples)
    assert block.time[-1, -1] <= drive.time[-1] + 1e-12


def test_a_masked_reading_masks_what_is_read_beside_it():
    (drive,) = drives((10.0,), periods=5.3, samples=200.37)
    y = drive.time.copy()
    y[500] = np.nan
    block = block_of(drive, y)
    place = block.time / drive.step_s
    beside = np.abs(place - 500) < 1 - 1e-5
    np.testing.assert_array_equal(block.use == 0, beside)
    assert beside.sum() in (1, 2)
    np.testing.assert_allclose(block.data[~beside], block.time[~beside], atol=1e-12)


def test_model_rows_are_read_as_readings_are():
    """`of` on the padded row of readings gives the block's own data."""
    recording = Recording.of(
        runs := [*drives((10.0,), phase=0.37, periods=3.4), *drives((40.0,), samples=150.7)],
        [np.sin(40 * d.time) for d in runs],
    )
    data = to_batch(recording, lead=True)
    for k, block in enumerate(period_blocks(recording, data)):
        np.testing.assert_allclose(block.interpolate(data.y[k]), block.data, atol=1e-12)
        both = block.interpolate(np.stack([data.y[k], 2 * data.y[k]]))
        np.testing.assert_allclose(both[1], 2 * block.data, atol=1e-12)


@pytest.mark.parametrize("periods", [2, 3, 5, 6])
def test_parts_of_a_repeating_run_are_whole_periods_that_make_up_the_run(periods):
    block = counted(drives((10.0,), periods=periods)[0])
    for cut in (1 / 3, 1 / 2, 2 / 3):
        seen, held = slice_block(block, 0.0, cut), slice_block(block, cut, 1.0)
        assert seen.periods == round(cut * block.periods)
        assert seen.periods + held.periods == block.periods
        for name in ("left", "right", "fraction", "time", "data", "use", "drive"):
            both = np.concatenate([getattr(seen, name), getattr(held, name)])
            np.testing.assert_array_equal(both, getattr(block, name))
        np.testing.assert_array_equal(seen.phase, block.phase)
        assert (seen.step_s, seen.repeats) == (block.step_s, block.repeats)


@pytest.mark.parametrize("drive", [drives((10.0,), periods=1)[0], wandering(500)])
def test_parts_of_one_period_are_stretches_of_it(drive):
    block = counted(drive)
    seen, held = slice_block(block, 0.0, 2 / 3), slice_block(block, 2 / 3, 1.0)
    assert block.periods == seen.periods == held.periods == 1
    assert seen.size == round(2 / 3 * block.size)
    for name in ("left", "fraction", "time", "data", "use", "drive"):
        both = np.concatenate([getattr(seen, name), getattr(held, name)], axis=1)
        np.testing.assert_array_equal(both, getattr(block, name))
    np.testing.assert_array_equal(np.concatenate([seen.phase, held.phase]), block.phase)


@pytest.mark.parametrize(
    ("samples", "left"),
    [(200, 200), (1024, 1024), (1025, 1025), (1100, 550), (4000, 800), (40_000, 625)],
)
def test_thinning_leaves_whole_periods_of_512_to_1024_samples(samples, left):
    """1025 = 5 x 5 x 41 has no divisor that leaves 512: it stays. 4000 / 5, 40000 / 64."""
    (drive,) = drives((10.0,), samples=samples)
    recording = Recording.of([drive], [np.arange(drive.size, dtype=float)])
    (run,) = decimate(recording).runs
    assert run.drive.size == 3 * left
    every = samples // left
    np.testing.assert_array_equal(run.response, np.arange(0, drive.size, every))
    np.testing.assert_array_equal(run.drive.value, drive.value[::every])
    assert run.drive.periods == drive.periods == 3
    assert 1 / (10.0 * run.drive.step_s) == pytest.approx(left, rel=1e-9)


def test_thinning_of_periods_that_are_not_whole():
    (drive,) = drives((10.0,), samples=40_000.37)
    (run,) = decimate(Recording.of([drive], [drive.value])).runs
    assert 512 <= 1 / (10.0 * run.drive.step_s) <= 1024
    np.testing.assert_array_equal(run.response, run.drive.value)


def test_thinning_of_a_run_that_does_not_repeat():
    sizes = (50_000, 1025, 1024)
    recording = Recording.of([wandering(n) for n in sizes], [np.zeros(n) for n in sizes])
    long, some, short = decimate(recording).runs
    assert 512 <= long.drive.size <= 1024
    assert some.drive.size == 513
    assert short is recording.runs[2]


def test_thinning_keeps_masks_names_and_times():
    (drive,) = drives((10.0,), samples=4000)
    drive = dataclasses.replace(drive, start_s=7.0)
    y = np.arange(drive.size, dtype=float)
    y[5:20] = np.nan
    (run,) = decimate(Recording.of([drive], [y])).runs
    assert run.name == "run00" and run.drive.start_s == 7.0 and run.drive.rate == 10.0
    np.testing.assert_array_equal(np.flatnonzero(~run.valid), [1, 2, 3])


def test_turning_points_between_the_samples_left_are_found_again():
    """The corner of a thinned triangle is exact where it falls between samples."""
    (drive,) = drives((10.0,), samples=4000, phase=0.0003)
    thin = decimate(Recording.of([drive], [drive.value]))
    data = to_batch(thin, lead=True)
    assert data.u.min() == pytest.approx(1.5, abs=1e-9)
    assert data.u.max() == pytest.approx(4.5, abs=1e-9)
