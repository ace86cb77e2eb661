"""Turns, phases and cavity peaks from raw fringes, against the equations that made them."""

import dataclasses

import numpy as np
import pytest
from fringe_scans import C, FringeScans

from rapi_jax import DataError
from rapi_jax.ranging.reading._decimate import decimate, fringe_rates, plan_decimation
from rapi_jax.ranging.reading._scans import list_clipped, read_scans
from rapi_jax.ranging.reading._turns import find_turns


def _random_scans(seed):
    rng = np.random.default_rng(seed)
    scans = FringeScans(
        bend=(rng.uniform(-0.05, 0.05), rng.uniform(-0.2, 0.2)),
        first_turn_s=rng.uniform(0.004, 0.096),
        noise=10 ** rng.uniform(-3, -1.3),
        rounding_s=float(rng.choice([0, 1e-3, 2e-4])),
        span_hz=rng.uniform(20, 80) * 1e9,
        sample_hz=5e5,
        cavity=False,
    )
    return scans, rng.uniform(0.1, 1.0), float(rng.choice([1.2, 2.0, 3.0]))


@pytest.mark.parametrize("seed", range(30))
def test_turns_and_directions_are_found_from_the_interferometer_alone(seed):
    scans, distance, periods = _random_scans(seed)
    record = scans.record(distance, periods=periods, seed=seed)
    rates, _ = plan_decimation(record.interferometer, record.measurement, scans.sample_hz, "r")
    (x,) = decimate((record.interferometer,), rates.factor)
    turns, faults = find_turns(
        x,
        scans.sample_hz / rates.factor,
        rates.interferometer,
        scans.rate_hz,
        symmetric=True,
        rising_at_start=record.rising_at_start,
        drive=None,
        name="r",
    )
    cycles = (turns.time_s - scans.first_turn_s) * scans.rate_hz
    off = (cycles + 0.25) % 0.5 - 0.25
    assert np.abs(off).max() < 0.004 and not faults
    assert (turns.rising == ((cycles + 0.25) % 1.0 < 0.5)).all()


def test_groups_are_averaged_as_numpy_does_it():
    rng = np.random.default_rng(0)
    both = rng.integers(-2000, 2000, size=(300_007, 3)).astype(np.int16)
    found = decimate((both[:, 0], both[:, 2]), 7)
    whole = both[: 300_007 // 7 * 7].reshape(-1, 7, 3).mean(axis=1)
    for column, one in zip((0, 2), found, strict=True):
        np.testing.assert_allclose(one, whole[:, column], atol=2e-4)


def test_rates_of_a_known_tone():
    t = np.arange(400_000) / 1e6
    typical, highest = fringe_rates(np.cos(2 * np.pi * 36_000 * t).astype(np.float32), 1e6)
    assert abs(typical - 36_000) < 200 and abs(highest - 36_000) < 300
    assert fringe_rates(np.random.default_rng(0).standard_normal(400_000), 1e6) == (0.0, 0.0)


@pytest.mark.parametrize("bend", [(0.0, 0.0), (0.02, 0.18)])
def test_phase_and_peaks_are_those_of_the_optical_frequency(bend):
    scans = FringeScans(bend=bend)
    (reading,) = read_scans(scans.records(scans.record(0.7)))
    assert not reading.faults and {s.rising for s in reading.scans} == {True, False}
    for group in reading.scans:
        for k in range(group.count):
            t = group.begin_s[k] + np.arange(group.first, group.last + 1) / group.hz
            sign = 1 if group.rising else -1
            truth = sign * 2 * np.pi * scans.frequency(t) * scans.path_m / C
            off = group.phase[k, group.first : group.last + 1] - truth
            # White noise of 2e-3 beside an amplitude of 0.4, in part filtered away.
            assert np.std(off) < 2e-3 / 0.4 * np.sqrt(2.0)
            peaks = group.peaks[k]
            order = (scans.frequency(peaks.time_s) + scans.origin_hz) / scans.spacing_hz + 0.37
            error = (order - np.rint(order)) * scans.spacing_hz
            rate = np.abs(np.gradient(scans.frequency(t), t)).mean()
            stated = np.median(peaks.stderr_s) * rate
            assert 0.7 < np.std(error) / stated < 1.5 and peaks.time_s.size >= 40


def test_a_long_record_is_read_in_blocks_without_a_seam():
    scans = FringeScans(sample_hz=2.5e5, span_hz=30e9, first_turn_s=0.033, cavity=False)
    record = scans.record(0.3, periods=75)
    middles, rising = [], []
    for reading in read_scans(scans.records(record)):
        for group in reading.scans:
            middles += list(group.middle_s)
            rising += [group.rising] * group.count
    order = np.argsort(middles)
    middles, rising = np.array(middles)[order], np.array(rising)[order]
    assert middles.size == 149  # the branches cut by the record's ends are left out
    np.testing.assert_allclose(np.diff(middles), 0.05, atol=2e-4)
    assert (rising[1:] != rising[:-1]).all()
    assert rising[0] == (((middles[0] - 0.033) * 10) % 1.0 < 0.5)


def test_a_recorded_drive_tells_the_direction():
    scans = FringeScans(first_turn_s=0.02)
    record = scans.record(0.7)
    t = np.arange(record.size) / scans.sample_hz
    drive = scans.frequency(t).astype(np.float32)
    told = dataclasses.replace(record, rising_at_start=None, drive=drive)
    (reading,) = read_scans(scans.records(told))
    up = next(group for group in reading.scans if group.rising)
    assert (((up.middle_s - 0.02) * 10) % 1.0 < 0.5).all() and not reading.faults


def test_what_is_wrong_with_a_record_is_said():
    scans = FringeScans()
    record = scans.record(0.7)
    clipped = dataclasses.replace(record, measurement=np.minimum(record.measurement, 0.7))
    assert "clipped" in list_clipped(clipped, None)[0]
    assert not list_clipped(record, None)
    unknown = dataclasses.replace(record, rising_at_start=None)
    (reading,) = read_scans(scans.records(unknown))
    assert "rising_at_start" in reading.faults[0]
    noise = np.random.default_rng(0).standard_normal(record.size).astype(np.float32)
    with pytest.raises(DataError, match="auxiliary interferometer shows no fringes"):
        next(read_scans(scans.records(dataclasses.replace(record, interferometer=noise))))
    (reading,) = read_scans(scans.records(dataclasses.replace(record, measurement=noise)))
    assert "no target" in reading.faults[0]
    with pytest.raises(DataError, match="at least one whole period"):
        next(read_scans(scans.records(scans.record(0.7, periods=0.6))))
