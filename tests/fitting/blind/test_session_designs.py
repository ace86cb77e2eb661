"""Sessions of many designs: what is drawn, and that each can be recorded."""

import numpy as np
import pytest

from fitting.blind.protocol._answers import answer_record, read_spec
from fitting.blind.protocol._exchange import to_recording
from fitting.blind.protocol._tiers import bank_entries
from fitting.blind.simulator._scan import Scan
from fitting.blind.simulator._session_designs import TABLE, draw_session
from fitting.blind.simulator._signal_path import drive_with_corners
from fitting.blind.simulator._simulated_device import draw_device


def test_the_designs_are_many():
    sessions = [draw_session(np.random.default_rng(seed)) for seed in range(300)]
    assert {len(scans) for scans in sessions} == set(range(1, 13))
    assert {len({s.rate_hz for s in scans}) for scans in sessions} == set(range(1, 7))
    assert {len({s.swing for s in scans}) for scans in sessions} == {1, 2, 3}
    every = [scan for scans in sessions for scan in scans]
    assert {s.periods for s in every} == set(range(1, 7))
    assert {s.waveform for s in every} == {"triangle", "sine", "other"}
    sizes = [sum(s.drive.size for s in scans) for scans in sessions]
    assert min(sizes) < 700 and max(sizes) > 20_000 and max(sizes) <= 60_000
    for s in every:
        assert 0.5 <= s.rate_hz <= 150.0 and 60 <= s.samples <= 4000
        assert 0.0 < s.drive.min() and s.drive.max() < 6.0
        assert s.bias - s.swing / 2 - 1e-9 <= s.drive.min() <= s.drive.max()
        assert s.drive.max() <= s.bias + s.swing / 2 + 1e-9
    for scans in sessions:
        for one, after in zip(scans, scans[1:], strict=False):
            assert after.start_s > one.start_s + one.duration_s + 0.4


@pytest.mark.parametrize("seed", range(4))
def test_a_device_in_any_session_is_recorded_as_it_was_drawn(seed):
    device = draw_device(seed, "listed", "etalon", 5.0, any_session=True)
    recording = to_recording(device.runs)
    assert len(recording.runs) == len(device.runs)
    assert [r.response.size for r in recording.runs] == [r.response.size for r in device.runs]
    usual = draw_device(seed, "listed", "etalon", 5.0)
    assert [r.excitation_hz for r in usual.runs] != [r.excitation_hz for r in device.runs]


def test_the_tier_holds_all_kinds_and_its_answers_draw_the_same_devices():
    entries = bank_entries("sessions", 5, 40)
    assert {e.spec.kind for e in entries} == {"null", "listed", "form", "pair", "unlisted"}
    assert all(e.spec.any_session and e.withheld is None for e in entries)
    assert not any(e.spec.any_session for e in bank_entries("open", 5, 40))
    spec = next(e.spec for e in entries if e.spec.kind == "null")
    device = spec.draw()
    again = read_spec(answer_record(spec, device, "0")).draw()
    assert again.name == device.name
    for a, b in zip(again.runs, device.runs, strict=True):
        np.testing.assert_array_equal(a.response, b.response)


@pytest.mark.parametrize("tier", ["sealed", "nulls"])
def test_half_of_a_bank_that_judges_is_recorded_in_sessions_of_any_design(tier):
    entries = bank_entries(tier, 5, 200)
    assert sum(e.spec.any_session for e in entries) == 100
    for misfit in (False, True):  # whatever else a device is
        of = [e.spec.any_session for e in entries if e.spec.base_misfit is misfit]
        assert 0.35 < np.mean(of) < 0.65


@pytest.mark.parametrize("rise", [0.613, 0.777])
def test_corners_of_a_tables_ramps_are_reached_between_the_ticks(rise):
    """Else plays turn early, by up to half a tick of the ramp, and no model knows it."""
    place = np.arange(TABLE) / TABLE
    table = np.interp(place, [0.0, rise, 1.0], [1.0, 4.0, 1.0])
    scan = Scan(5.0, 3.0, 2.5, "other", periods=3, samples=60, phase=0.25, table=table)
    step = scan.step_s / 8
    local = np.arange(3 * 60 * 8) * step
    drive = drive_with_corners(scan, local, 8)
    assert drive.max() == table.max() and drive.min() == table.min()
    changed = np.flatnonzero(drive != scan.voltage(local))
    assert 2 <= changed.size <= 6 and not (changed % 8 == 0).any()
