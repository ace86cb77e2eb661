"""`range_records` end to end: rest, motion, air, scale; what it says beside the numbers."""

import dataclasses

import numpy as np
import pytest
from fringe_scans import FringeScans

from rapi_jax import DataError, plot
from rapi_jax.ranging import AirState
from rapi_jax.ranging._range import range_records
from rapi_jax.ranging._ranging import with_scatter
from rapi_jax.ranging.air import group_index

SCANS = FringeScans(bend=(0.02, 0.1), origin_hz=-37.5e9, noise=4e-3)


def test_a_target_at_rest_over_several_records():
    """Records far apart in time share one scale; each scan is put at its own time."""
    records = SCANS.records(
        *(
            SCANS.record(0.7, periods=3, start_s=start, seed=k, name=f"record{k:02d}")
            for k, start in enumerate((0.0, 40.0))
        )
    )
    seen = []
    result = range_records(records, on_part=seen.append)
    assert result.table.size == sum(part.size for part in seen) >= 10
    assert (np.diff(result.time_s) > 0).all() and result.time_s[-1] > 40.0
    assert result.target.track is not None
    assert np.abs((result.distance - 0.7) / result.stderr).max() < 4.5
    assert result.stderr.max() < 1e-6
    assert (np.abs(result.target.track.velocity) < 4 * result.target.track.velocity_stderr).all()
    assert "index is taken as 1" in " ".join(result.faults)
    assert {shape.rising for shape in result.shapes} == {True, False}


@pytest.mark.parametrize("velocity", [0.05, -0.01])
def test_a_moving_target(velocity):
    """Distance and velocity, though every apparent distance is metres off and has lost its sign."""
    record = SCANS.record(lambda t: 0.6 + velocity * t, periods=8)
    result = range_records(SCANS.records(record), expected_m=(0.1, 2.0))
    truth = 0.6 + velocity * result.time_s
    track = result.target.track
    assert track is not None
    assert np.abs((track.velocity - velocity) / track.velocity_stderr).max() < 4.0
    assert np.abs((track.distance - truth) / track.distance_stderr).max() < 4.0
    assert np.abs((result.distance - truth) / result.stderr).max() < 5.0
    assert track.velocity_stderr.max() < 2e-5 * abs(velocity) + 1e-7
    middle, bottom = plot.ranging(result).axes[1:]
    assert middle.get_title("left").startswith(f"velocity of the track, less {1e3 * velocity:.0f}")
    shown = middle.lines[0].get_ydata()
    assert np.abs(shown).max() < 100.0  # the axis has no offset of its own
    assert bottom.get_ylim()[1] > 1e3 * result.table.bend_ghz.max()  # every scan is within it


def test_distance_is_divided_by_the_group_index():
    air = AirState(20.0, 101_325.0, 0.5)
    record = SCANS.record(0.7, periods=3)
    plain = range_records(SCANS.records(record))
    result = range_records(SCANS.records(record).replace(air=air))
    index = group_index(air, SCANS.wavelength_m)
    np.testing.assert_allclose(result.distance, plain.distance / index.value, rtol=1e-9)
    assert result.air_index.value == index.value > 1.00027
    # Its error is in every scan's: 0.1 K, 20 Pa and 2 % of humidity are 1e-7 of the distance.
    shared = 0.7 * index.stderr
    assert result.target.shared > 0.9 * shared and (result.stderr > 0.9 * shared).all()
    assert "index is taken as 1" not in " ".join(result.faults)


def test_without_a_filter_every_scan_stands_alone():
    record = SCANS.record(0.7, periods=3)
    result = range_records(SCANS.records(record), kalman=False)
    assert result.target.track is None
    np.testing.assert_allclose(result.distance, 0.7, atol=5e-7)
    short = SCANS.record(0.7, periods=1.2)
    asked = range_records(SCANS.records(short), kalman=True)
    assert asked.target.track is None and "no track" in " ".join(asked.faults)


def test_a_wrong_path_is_said_and_the_cavity_used():
    record = SCANS.record(0.7, periods=3)
    wrong = SCANS.records(record).replace(interferometer_path_m=7.34 * 1.02)
    result = range_records(wrong)
    np.testing.assert_allclose(result.distance, 0.7, atol=1e-6)
    assert "the interferometer's path by the cavity differs by" in " ".join(result.faults)
    alone = dataclasses.replace(record, cavity=None)
    blind = range_records(SCANS.records(alone).replace(cavity_spacing_hz=None))
    np.testing.assert_allclose(blind.distance, 0.7, atol=1e-6)
    assert "no cavity" in " ".join(blind.faults)


def test_scatter_beyond_the_noise_of_a_scan_is_in_its_error():
    rng = np.random.default_rng(0)
    rising = np.arange(40) % 2 == 0
    t = np.arange(40) * 0.05
    steady = 5.0 + 0.3 * t + 0.1 * t**2
    own = np.full(40, 1e-7)
    quiet = with_scatter(steady + own * rng.standard_normal(40), own, rising)
    assert quiet.max() < 3e-7
    shaken = with_scatter(steady + 2e-5 * rng.standard_normal(40), own, rising)
    assert 1e-5 < shaken.min() and shaken.max() < 4e-5
    spoiled = steady + 2e-5 * rng.standard_normal(40)
    spoiled[7] += 1.0
    assert with_scatter(spoiled, own, rising).max() < 6e-5


def test_nothing_to_range_with():
    with pytest.raises(DataError, match="`method`"):
        range_records(SCANS.records(SCANS.record(0.7)), method="guess")
