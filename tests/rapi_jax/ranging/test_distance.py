"""Estimators of distance against scans whose distance is known, at rest and in motion."""

import dataclasses

import numpy as np
import pytest
from fringe_scans import C, FringeScans

from rapi_jax import DataError
from rapi_jax.ranging._scan_table import join, read_table
from rapi_jax.ranging.distance._estimators import ESTIMATORS, estimator
from rapi_jax.ranging.distance._scale import ScaleSums

METHODS = tuple(ESTIMATORS)


def _table(scans, record, method, sums=None):
    sums = ScaleSums() if sums is None else sums
    return join([part.table for part in read_table(scans.records(record), sums, method=method)])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("distance", [0.3, 0.7, 2.0])
def test_a_target_at_rest(method, distance):
    scans = FringeScans()
    table = _table(scans, scans.record(distance, periods=6), method)
    assert table.size in (11, 12) and set(table.problem) == {""}
    score = (table.path - distance) / table.stderr
    # One scale for all: its part is shared, and small beside four standard errors.
    assert np.abs(score).max() < 4.5
    assert np.std(table.path) < 1.6 * np.median(table.stderr)
    np.testing.assert_allclose(table.span_hz, 0.8 * scans.span_hz, rtol=0.03)


def test_resampling_is_finer_than_counting():
    scans = FringeScans()
    record = scans.record(0.7, periods=6)
    spread = {method: np.std(_table(scans, record, method).path) for method in METHODS}
    assert spread["resample-phase"] < 1e-7 and spread["resample-fft"] < 1.5e-7
    assert spread["counting"] > 3 * spread["resample-fft"]


def test_a_crooked_scan_costs_counting_what_the_cavity_leaves_between_its_peaks():
    """Interpolating orders over 1.5 GHz errs by tens of um; counting between peaks does not."""
    scans = FringeScans(bend=(0.0, 0.12), noise=5e-4)
    record = scans.record(0.7, periods=4)
    off = {m: np.abs(_table(scans, record, m).path - 0.7) for m in METHODS}
    down = ~_table(scans, record, "counting").rising
    assert off["counting-region"][down].min() > 1e-5
    assert off["counting"][down].max() < 3e-6
    assert off["resample-phase"].max() < 3e-7


@pytest.mark.parametrize("method", ["counting", "resample-phase"])
@pytest.mark.parametrize("velocity", [0.05, -0.02])
@pytest.mark.parametrize("bend", [(0.0, 0.0), (0.02, 0.15)])
def test_motion_counts_as_the_answer_to_motion_says(method, velocity, bend):
    """The apparent distance is |L + G v + A a|; 4000 times the motion, to 3e-6 of it."""
    scans = FringeScans(bend=bend, origin_hz=-37.5e9, sample_hz=2e6)
    acceleration = 0.05
    record = scans.record(lambda t: 0.6 + velocity * t + acceleration * t**2 / 2, periods=3, seed=3)
    table = _table(scans, record, method)
    t = table.time_s
    speed = velocity + acceleration * t
    truth = (
        0.6
        + velocity * t
        + acceleration * t**2 / 2
        + table.velocity_s * speed
        + table.acceleration_s2 * acceleration
    )
    tolerance = 4.5 * table.stderr + 4e-6 * np.abs(table.velocity_s * speed)
    assert (np.abs(table.path - np.abs(truth)) < tolerance).all()
    gain = C / scans.wavelength_m / table.span_hz * 0.04
    np.testing.assert_allclose(np.abs(table.velocity_s), gain, rtol=0.1)
    assert (np.sign(table.velocity_s) == np.where(table.rising, 1, -1)).all()


def test_the_cavity_tells_the_scale():
    """The delay that the cavity tells, whatever path is stated; counting needs none."""
    scans = FringeScans()
    record = scans.record(0.7, periods=6)
    sums = ScaleSums()
    wrong = scans.records(record).replace(interferometer_path_m=7.34 * 1.004)
    parts = list(read_table(wrong, sums))
    scale = sums.scale(7.34 * 1.004 / C, scans.spacing_hz)
    assert abs(scale.delay_s * C / 7.34 - 1) < 4 * scale.stderr_s / scale.delay_s < 1e-6
    np.testing.assert_allclose(parts[0].table.path, 0.7, atol=1e-6)


def test_a_missed_or_doubled_peak_is_said_and_changes_nothing():
    scans = FringeScans()
    record = scans.record(0.7)
    assert record.cavity is not None
    cavity = record.cavity.copy()
    at = np.flatnonzero(cavity > 0.4)
    bright = at[at > 25_000][0]  # in the middle of the first branch
    cavity[bright - 40 : bright + 40] = 0.0
    cavity[bright + 200 : bright + 206] = 0.6
    for method in METHODS:
        parts = list(
            read_table(
                scans.records(dataclasses.replace(record, cavity=cavity)),
                ScaleSums(),
                method=method,
            )
        )
        said = " ".join(parts[0].faults)
        assert "1 missed" in said and "1 beside the comb" in said
        np.testing.assert_allclose(parts[0].table.path, 0.7, atol=4e-6)


def test_without_a_target_there_is_no_number():
    scans = FringeScans()
    record = scans.record(0.7)
    noise = np.random.default_rng(0).standard_normal(record.size).astype(np.float32)
    for method in METHODS:
        table = _table(scans, dataclasses.replace(record, measurement=noise), method)
        assert np.isnan(table.path).all() and "no target" in table.problem[0]


def test_estimators_have_names():
    assert estimator("counting").name == "counting"
    with pytest.raises(DataError, match="`method` must be one of"):
        estimator("guess")
