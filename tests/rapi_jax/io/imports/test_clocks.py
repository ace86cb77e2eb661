"""Clocks of files: gaps, jitter, few digits, holes, several sampling rates."""

from dataclasses import replace

import numpy as np
import pytest
from scope_files import VOLT_TO_GHZ, said, scanned, taken

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording


def test_gaps_part_a_record(tmp_path):
    t, u, y = scanned((10.0, 8, 4.5))
    keep = np.r_[0:7000, 7300:16000]
    made = taken(tmp_path, t[keep], u[keep], y[keep])
    assert [run.drive.periods for run in made.recording.runs] in ([3, 3], [3, 4])
    assert "gap after sample 6999: 0.01505 s without samples" in said(made)


def test_times_of_few_digits_and_a_jittering_clock(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5))
    made = taken(tmp_path, np.round(t, 4), u, y)
    assert "times are printed in steps of 0.0001 s" in said(made)
    np.testing.assert_allclose(made.recording.runs[0].drive.step_s, 5e-5, rtol=1e-3)
    rng = np.random.default_rng(0)
    late = t + 2e-5 * rng.uniform(-1, 1, t.size)
    made = taken(tmp_path, late, np.interp(late, t, u), np.interp(late, t, y))
    assert "sampling is uneven" in said(made) and "resampled" in said(made)
    run = made.recording.runs[0]
    np.testing.assert_allclose(
        run.drive.value, np.interp(run.drive.time + late[0], t, u), atol=0.01
    )


def test_parts_of_two_sampling_rates_keep_their_own(tmp_path):
    t, u, y = scanned((10.0, 8, 4.5), noise=0.0)
    keep = np.r_[0:8000, 8000:16000:4]
    made = taken(tmp_path, t[keep], u[keep], y[keep])
    assert "the sampling rate changes (20000 Hz from 0 s, 5000 Hz from 0.4 s)" in said(made)
    one, other = made.recording.runs
    assert (one.drive.periods, other.drive.periods) == (4, 4)
    np.testing.assert_allclose((one.drive.step_s, other.drive.step_s), (5e-5, 2e-4))
    np.testing.assert_array_equal(np.r_[one.response, other.response], y[keep])
    np.testing.assert_allclose(other.drive.start_s, 0.4)


def test_of_samples_at_one_time_the_first_is_kept_and_that_is_said(tmp_path):
    """A loop that writes several rows for each tick of its clock, of which the last ones differ."""
    t, u, y = scanned((10.0, 4, 4.5), sample_hz=2000.0, noise=0.0)
    count = np.random.default_rng(0).integers(1, 5, t.size)
    first = np.r_[0, np.cumsum(count)[:-1]]
    columns = [np.repeat(column, count) for column in (t, u, y)]
    columns[2] += np.where(np.isin(np.arange(count.sum()), first), 0.0, 7.0)
    made = taken(tmp_path, *columns)
    again = int(count.sum() - t.size)
    assert f"{again} sample(s) have the time of the one before them" in said(made)
    assert "the first sample is kept" in said(made)
    (run,) = made.recording.runs
    at = run.drive.time + run.drive.start_s
    np.testing.assert_allclose(run.response, np.interp(at, t, y), atol=1e-6)
    jitter = t + 1e-4 * np.random.default_rng(1).uniform(-1.0, 1.0, t.size)
    uneven = said(taken(tmp_path, jitter, u, y))
    assert "resampled to every" in uneven and "have the time of" not in uneven


def test_a_sampling_rate_that_changes_within_a_cycle_is_brought_to_the_slower(tmp_path):
    t, u, y = scanned((10.0, 8, 4.5), noise=0.0)
    dense = np.mod(np.arange(16000), 500) < 250  # an eighth of a period
    keep = np.flatnonzero(dense | (np.arange(16000) % 4 == 0))
    made = taken(tmp_path, t[keep], u[keep], y[keep])
    assert "several sampling rates" in said(made) and "resampled to every" in said(made)
    assert "which averages up to 4 samples" in said(made)
    (run,) = made.recording.runs
    assert run.drive.periods >= 7
    at = run.drive.time + run.drive.start_s
    np.testing.assert_allclose(run.response[1:-1], np.interp(at, t, y)[1:-1], atol=0.1)


def test_drive_and_response_with_clocks_of_their_own(tmp_path):
    t, u, y = scanned((10.0, 4, 4.5), noise=0.0)
    np.savez(tmp_path / "u.npz", time=t, drive=u)
    np.savez(tmp_path / "y.npz", time=t[100::5], response=y[100::5])
    options = replace(VOLT_TO_GHZ, drive_file=str(tmp_path / "u.npz"))
    made = import_recording(tmp_path / "y.npz", options)
    assert "clocks of their own (steps of 5e-05 and 0.00025 s)" in said(made)
    (run,) = made.recording.runs
    np.testing.assert_allclose(run.drive.value, u[100::5], atol=0.02)
    np.testing.assert_array_equal(run.response, y[100::5])


def printed(t, u, y, digits=6) -> str:
    """Rows whose times have so many significant digits, as Rohde & Schwarz print them."""
    lines = [
        f"{a:.{digits - 1}E},{b:.6E},{c:.6E}"
        for a, b, c in zip(t.tolist(), u.tolist(), y.tolist(), strict=True)
    ]
    return "in s,C1 in V,C2 in V\n" + "\n".join(lines) + "\n"


@pytest.mark.parametrize("begin", [-6.3e-3, 0.0, 8.7e-3])
def test_times_of_few_digits_are_no_gaps(tmp_path, begin):
    phase = (
        np.arange(60_000) / 20_000
    )  # three periods of 4.03 ms: past 10 ms a digit is half a step
    t, u = begin + 2.016e-7 * np.arange(phase.size), 3.0 - 2.0 * np.cos(2 * np.pi * phase)
    text = printed(t, u, 4.0 * u)
    (tmp_path / "a.csv").write_text(text)
    made = import_recording(tmp_path / "a.csv", ImportOptions(drive="C1", response="C2"))
    (run,) = made.recording.runs
    assert (run.drive.size, run.drive.periods) == (t.size, 3)
    np.testing.assert_allclose(run.drive.step_s, 2.016e-7, rtol=1e-5)
    assert ("printed in 6 digits" in said(made)) or ("printed in steps of" in said(made))
    lines = text.split("\n")
    (tmp_path / "b.csv").write_text("\n".join(lines[:40_000] + lines[40_001:]))  # one is missing
    try:
        cut = import_recording(tmp_path / "b.csv", ImportOptions(drive="C1", response="C2"))
    except DataError as refused:
        assert "jitters" in str(refused) or "missing" in str(refused)
    else:
        assert "gap after sample 39998" in said(cut)


def test_no_reading_is_put_where_the_file_has_none(tmp_path):
    """Uneven throughout, with two holes: of 40 and of 5 steps."""
    t, u, y = scanned((10.0, 4, 4.5), sample_hz=2000.0, noise=0.0)
    t = t + 2e-4 * np.random.default_rng(2).uniform(-1.0, 1.0, t.size)
    holes = [(101, 140), (400, 404)]  # first and last sample that are missing
    left = np.ones(t.size, dtype=bool)
    for first, last in holes:
        left[first : last + 1] = False
    left[np.random.default_rng(3).choice(t.size, 30, replace=False)] = False  # no few gaps
    made = taken(tmp_path, t[left], u[left], y[left])
    assert "lie where the file has none" in said(made)
    (run,) = made.recording.runs
    at = run.drive.time + run.drive.start_s + t[left][0]
    for first, last in holes:
        inside = (at > t[first]) & (at < t[last])
        assert inside.any() and not run.valid[inside].any()
    far = np.min(np.abs(at[:, None] - t[left]), axis=1) > 2e-3  # four steps from any reading
    wide = sum(t[last + 1] - t[first - 1] for first, last in holes) / run.drive.step_s
    assert not run.valid[far].any() and 0.7 * wide < (~run.valid).sum() < wide
    whole = said(taken(tmp_path, t, u, y))
    assert "resampled to every" in whole and "where the file has none" not in whole
