"""Bad fringe records: each fault is said in words, and no wrong number comes without them."""

import dataclasses

import numpy as np
import pytest
from fringe_scans import FringeScans

from rapi_jax import DataError
from rapi_jax.ranging import AirState, range_records

SCANS = FringeScans(bend=(0.01, -0.08), first_turn_s=0.004)
TARGET = 0.7
BASE = SCANS.record(TARGET)
HZ = SCANS.sample_hz


def records(record=BASE, **changes):
    return SCANS.records(record).replace(**changes)


def changed(**columns):
    return dataclasses.replace(BASE, **columns)


def dark(name, begin=0.12, seconds=0.005):
    """A channel without light for a while; its mean falls, too."""
    column = getattr(BASE, name).copy()
    part = column[int(begin * HZ) : int((begin + seconds) * HZ)]
    part[:] = 0.05 + 2e-3 * np.random.default_rng(3).standard_normal(part.size)
    return column


def silent(level=2e-3):
    return (0.45 + level * np.random.default_rng(5).standard_normal(BASE.size)).astype(np.float32)


def assert_said(found, *words):
    text = "\n".join(found.faults)
    assert [word for word in words if word not in text] == [], text


def assert_right(found, *, lost=(), within=3e-6):
    """Every scan is right within its error, but those that are lost, which have no distance."""
    expected = np.ones(found.table.size, dtype=bool)
    expected[list(lost)] = False
    assert (np.isfinite(found.distance) == expected).all()
    assert (np.array([not p for p in found.table.problem]) == expected).all()
    off = np.abs(found.distance[expected] - TARGET)
    assert off.max() < within
    assert (off < 6 * found.stderr[expected] + 2e-7).all()


def refused(record=BASE, **changes) -> str:
    with pytest.raises(DataError) as caught:
        range_records(records(record, **changes))
    said = str(caught.value)
    assert said.isprintable()
    return said


def test_good_records_have_no_fault_but_unknown_air():
    found = range_records(records())
    assert_right(found)
    assert_said(found, "the state of the air is not given", "0.027 % too long")
    assert len(found.faults) == 1
    assert (found.stderr < 1e-6).all()  # errors of 0.06 um beside a prior of metres
    known = range_records(records(air=AirState(20.0, 101325.0, 0.5)))
    assert known.faults == ()
    assert known.summary.distance == pytest.approx(TARGET / known.air_index.value, abs=1e-6)


@pytest.mark.parametrize("measurement", [silent(), np.full(BASE.size, 0.45, dtype=np.float32)])
def test_no_target(measurement):
    found = range_records(records(changed(measurement=measurement)))
    assert_said(found, "no target", "5 of 5 scans", "blocked")
    assert np.isnan(found.distance).all() and np.isnan(found.stderr).all()
    assert found.summary.counted == 0 and np.isnan(found.summary.distance)


@pytest.mark.parametrize(("offset", "amplitude"), [(0.0055, 0.05), (0.02, 0.05), (-0.3, 0.3)])
def test_a_second_reflector(offset, amplitude):
    found = range_records(records(SCANS.record(TARGET, more=((offset, amplitude),))))
    side = "beyond" if offset > 0 else "before"
    assert_said(found, "a second reflector", side, f"{100 * amplitude:.0f} % of its fringes")
    (line,) = (line for line in found.faults if "second reflector" in line)
    assert float(line.split()[4]) == pytest.approx(1e3 * abs(offset), abs=0.8)
    assert np.abs(found.distance - TARGET).max() < 1e-4


def test_reflectors_as_strong_are_said_too():
    found = range_records(records(SCANS.record(TARGET, more=((0.3, 1.0),))))
    assert_said(found, "a second reflector")
    found = range_records(records(SCANS.record(TARGET, more=((0.006, 1.0),))))
    assert_said(found, "not of one target")
    assert np.isnan(found.distance).all()


@pytest.mark.parametrize(
    "motion",
    [
        lambda t: TARGET + 0.005 * t,
        lambda t: TARGET + 20e-9 * np.sin(2 * np.pi * 80 * t),
        lambda t: np.full(t.shape, TARGET),
    ],
    ids=["moving", "vibrating", "at rest"],
)
def test_one_target_is_not_taken_for_two(motion):
    noisy = dataclasses.replace(SCANS, noise=0.05)
    found = range_records(noisy.records(noisy.record(motion)))
    assert not [line for line in found.faults if "reflector" in line]


def test_a_target_that_moves_nearly_half_a_fringe_a_sample():
    found = range_records(records(SCANS.record(lambda t: TARGET + 0.19 * t)))
    assert_said(found, "fringes are aliased", "Sample faster")


def test_scans_of_one_direction_alone_are_said_to_be_of_a_target_at_rest():
    found = range_records(records(SCANS.record(lambda t: TARGET + 0.15 * t)))
    assert_said(found, "up-scans alone", "if it moves, each um/s")


@pytest.mark.parametrize("method", ["resample-phase", "resample-fft", "counting"])
def test_a_beam_blocked_for_5_ms(method):
    found = range_records(records(changed(measurement=dark("measurement"))), method=method)
    assert_said(found, "1 of 5 scans (first at 0.129 s)", "fringes lost")
    assert_right(found, lost=[2])


def test_all_light_lost_for_5_ms():
    """The scale is told by the other scans."""
    names = ("measurement", "interferometer", "cavity")
    found = range_records(records(changed(**{name: dark(name) for name in names})))
    assert_said(found, "the interferometer's fringes are lost")
    assert_right(found, lost=[2])
    assert found.scale.delay_s * 299_792_458 == pytest.approx(7.34, rel=1e-6)


@pytest.mark.parametrize(("extra", "said"), [(False, "1 missed"), (True, "1 beside the comb")])
def test_a_cavity_peak_missed_or_doubled(extra, said):
    cavity = BASE.cavity.copy()
    peaks = np.flatnonzero(cavity > 0.5)
    at = peaks[np.searchsorted(peaks, int(0.13 * HZ))]
    if extra:
        cavity[at + 400 : at + 600] = cavity[at - 100 : at + 100]
    else:
        cavity[at - 300 : at + 300] = 0
    for method in ("resample-phase", "counting"):
        found = range_records(records(changed(cavity=cavity)), method=method)
        assert_said(found, said, "orders are counted by the interferometer")
        assert_right(found)


@pytest.mark.parametrize("name", ["measurement", "interferometer"])
def test_a_clipped_detector(name):
    bent = np.clip(getattr(BASE, name), 0.1, 0.7)
    found = range_records(records(changed(**{name: bent})))
    assert_said(found, f"the detector of the {name} is clipped", "Widen its range")
    assert_right(found)


def test_a_clipped_cavity():
    found = range_records(records(changed(cavity=np.clip(BASE.cavity, -1, 0.4))))
    assert_said(found, "peaks are clipped")
    assert_right(found)


def test_without_a_cavity():
    bare = records(changed(cavity=None), cavity_spacing_hz=None)
    found = range_records(bare)
    assert_said(found, "no cavity tells the scale", "as right as `interferometer_path_m`")
    assert_right(found)
    counted = range_records(bare, method="counting")
    assert_said(counted, "fewer than three peaks of the cavity")
    assert np.isnan(counted.distance).all()
    dead = range_records(records(changed(cavity=np.zeros(BASE.size, dtype=np.float32))))
    assert_said(dead, "no peaks above its noise", "no even comb")


@pytest.mark.parametrize("column", [silent(), np.full(BASE.size, 0.45, dtype=np.float32)])
def test_no_fringes_of_the_interferometer(column):
    assert "interferometer shows no fringes" in refused(changed(interferometer=column))


def test_less_than_a_period():
    assert "0.5 periods" in refused(SCANS.record(TARGET, periods=0.5))
    found = range_records(records(SCANS.record(TARGET, periods=0.8)))
    assert_said(found, "no track: 1 readable up-scans alone")


@pytest.mark.parametrize("rate", [3.3333, 5.0, 9.0, 10.3, 11.0, 30.0, 40.0])
def test_a_wrong_rate_of_the_scan(rate):
    said = refused(excitation_hz=rate)
    assert "the laser does not turn as at" in said and "about 10 Hz" in said
    assert "Is `excitation_hz` right?" in said


def test_twice_the_rate_looks_like_turns_at_extrema_of_the_fringes():
    """Distances hold then, but every second turn is none."""
    found = range_records(records(excitation_hz=20.0))
    assert_said(found, "scans at 10 Hz", "velocities are wrong", "Is `excitation_hz` right?")
    assert np.abs(found.distance - TARGET).max() < 3e-6


def test_a_rate_that_is_slightly_wrong_is_mended():
    found = range_records(records(excitation_hz=10.1))
    assert_said(found, "the scan runs at", "not 10.1")
    assert_right(found)


def test_nothing_tells_the_direction():
    found = range_records(records(changed(rising_at_start=None)))
    assert_said(found, "taken as rising", "add `rising_at_start`")


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_a_path_1_percent_off(factor):
    found = range_records(records(interferometer_path_m=factor * 7.34))
    assert_said(found, "the interferometer's path by the cavity differs by")
    assert_right(found)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"interferometer_path_m": 7340.0}, "Is it in m?"),
        ({"interferometer_path_m": 0.734}, "36.73 fringes of the interferometer apart"),
        ({"cavity_spacing_hz": 1.5}, "Is it in Hz?"),
        ({"cavity_spacing_hz": 3e9}, "One of them is wrong, or in another unit"),
        ({"wavelength_m": 780.0}, "Is it in m?"),
    ],
)
def test_values_in_another_unit(change, said):
    assert said in refused(**change)


def test_channels_exchanged():
    swapped = changed(measurement=BASE.interferometer, interferometer=BASE.measurement)
    assert_said(range_records(records(swapped)), "no even comb", "are channels exchanged")


@pytest.mark.parametrize("name", ["measurement", "interferometer", "cavity"])
def test_a_number_that_is_not_finite(name):
    column = getattr(BASE, name).copy()
    column[100] = np.nan
    said = refused(changed(**{name: column}))
    assert f"`{name}` is not finite at sample 100" in said
