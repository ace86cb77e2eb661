"""Periods that are as the others of their run, and others: unsettled devices, and jumps."""

import dataclasses

import numpy as np
import pytest

from fitting import check_recording
from fitting.commands.shared._about import describe_recording
from fitting.identification._posed import Posed
from fitting.identification.assessment._noise import measure_noise
from fitting.identification.data_checks._first_period import first_period_miss
from fitting.identification.data_checks.periods._odd_periods import (
    compare_periods,
    find_late_starts,
    find_odd_periods,
    find_unsettled,
)
from rapi_jax import ECDL, RAPI, Recording, Run, triangle

ASKED = "whether the device had settled"
LAG_S, LAG_SHARE = 3e-3, 0.006


def white(rng, size):
    return rng.standard_normal(size)


def walk(rng, size):
    """A random walk below white noise, as of a free-running laser."""
    return rng.standard_normal(size) + np.cumsum(rng.standard_normal(size)) / np.sqrt(50.0)


def hum(rng, size):
    """A tone of 4.62 cycles in a period of 500 samples, with a phase by chance."""
    phase = 2.0 * np.pi * rng.random()
    return rng.standard_normal(size) + 1.5 * np.sin(
        2.0 * np.pi * 4.618 / 500 * np.arange(size) + phase
    )


def recorded(rng, make_noise, *, settled=True, periods=4, noise=0.02, drift=0.0) -> Recording:
    """Triangles at three rates; a lag of 3 ms starts from rest where the device had not settled."""
    drives = triangle([10.0, 20.0, 40.0], amplitude=4.5, bias=3.0, samples=2000, periods=periods)
    runs = []
    for k, drive in enumerate(drives):
        clean = 11.0 * drive.value + 0.2 * (drive.value - 3.0) ** 2 + drift * drive.time
        start = 0.0 if settled else LAG_SHARE * np.ptp(clean)
        lag = start * np.exp(-drive.time / LAG_S)
        read = clean - lag + noise * make_noise(rng, drive.size)
        runs.append(Run(drive, read, f"run{k:02d}"))
    return Recording(tuple(runs))


def masked(recording: Recording, rng, share=0.02) -> Recording:
    """The same with readings missing here and there, two beside one another at most."""
    runs = []
    for run in recording.runs:
        read = run.response.copy()
        for k in np.flatnonzero(rng.random(read.size // 8) < 4 * share):
            read[8 * k + 2 : 8 * k + 4] = np.nan
        runs.append(dataclasses.replace(run, response=read))
    return Recording(tuple(runs))


@pytest.mark.parametrize("periods", [3, 5])
def test_where_readings_are_missing_settled_recordings_are_settled(periods):
    rng = np.random.default_rng(7)
    alarms = sum(
        bool(find_unsettled(masked(recorded(rng, white, periods=periods), rng).runs))
        for _ in range(40)
    )
    assert alarms <= 4  # as below


def test_a_missing_reading_hides_no_lag_that_starts_from_rest():
    rng = np.random.default_rng(1)
    recording = masked(recorded(rng, white, settled=False), rng)
    assert all(not run.valid.all() for run in recording.runs)
    found = check_recording(recording)
    assert [run.settled for run in found.runs] == [False] * 3
    for run in found.runs:
        np.testing.assert_allclose(run.noise, 0.02, rtol=0.08)


@pytest.mark.parametrize("make_noise", [white, walk, hum])
@pytest.mark.parametrize("periods", [3, 5])
def test_settled_recordings_are_told_to_be_unsettled_once_in_a_hundred(make_noise, periods):
    rng = np.random.default_rng(3)
    alarms = sum(
        bool(find_unsettled(recorded(rng, make_noise, periods=periods).runs)) for _ in range(40)
    )
    assert alarms <= 4  # of 40: by chance once in 1500 of such tests at a rate of 1 %


@pytest.mark.parametrize("make_noise", [white, walk])
@pytest.mark.parametrize("periods", [3, 5])
def test_periods_that_are_alike_are_told_to_be_odd_once_in_a_hundred(make_noise, periods):
    rng = np.random.default_rng(5)
    alarms = sum(
        bool(find_odd_periods(recorded(rng, make_noise, periods=periods).runs)) for _ in range(40)
    )
    assert alarms <= 4  # as above


@pytest.mark.parametrize("period", [1, 2])
def test_a_jump_within_a_later_period_is_told_with_its_place_and_size(period):
    recording = recorded(np.random.default_rng(7), white, periods=3)
    run = recording.runs[1]
    jump = np.where(run.drive.time > (period + 0.2) / 20.0, 1.5, 0.0)
    if period == 1:  # and back again: period 3 is as the first
        jump[run.drive.period > 1] = 0.0
    runs = (recording.runs[0], dataclasses.replace(run, response=run.response + jump))
    (one,) = find_odd_periods(runs)
    assert (one.run, one.period) == ("run01", period)
    np.testing.assert_allclose(one.shift, 0.8 * 1.5, rtol=0.03)
    (note,) = check_recording(Recording(runs)).notes
    assert note.startswith(f"odd period: period {period + 1} of run 'run01'")
    assert "GHz" in note and "record that run again" in note


def test_what_a_bench_found_doubtful_is_told():
    noted = dataclasses.replace(
        recorded(np.random.default_rng(8), white),
        provenance={"run02_faults": "cavity: peak at 1 s; cavity: peak at 2 s; a third; a fourth"},
    )
    (note,) = check_recording(noted).notes
    assert "run 'run02' was doubtful: cavity: peak at 1 s" in note and "2 more" in note


def test_p_values_of_settled_runs_are_uniform():
    rng = np.random.default_rng(4)
    runs = [run for _ in range(60) for run in recorded(rng, white).runs]
    values = np.sort([compare_periods(run)[0].p for run in runs])
    even = (np.arange(values.size) + 0.5) / values.size
    # Kolmogorov's distance that chance exceeds once in 1000
    assert values.size == 180 and np.abs(values - even).max() < 1.95 / np.sqrt(values.size)


@pytest.mark.parametrize("periods", [3, 4, 8])
def test_a_lag_that_starts_from_rest_is_told_with_its_size_and_the_cure(periods):
    recording = recorded(np.random.default_rng(1), white, settled=False, periods=periods)
    found = check_recording(recording)
    asked = {question.name: question for question in found.questions}[ASKED]
    assert found.sound and asked.answer == "partly" and "--skip-periods 1" in asked.record
    assert all(name in asked.because for name in ("run00", "run01", "run02", "MHz rms"))
    assert [run.settled for run in found.runs] == [False] * 3
    for run in found.runs:  # not inflated by the first period
        np.testing.assert_allclose(run.noise, 0.02, rtol=0.08)


def test_noise_is_not_that_of_a_start_that_is_refused():
    runs = []
    for run in recorded(np.random.default_rng(4), white).runs:
        start = 0.05 * run.span * np.exp(-run.drive.time / LAG_S)
        runs.append(dataclasses.replace(run, response=run.response + start))
    found = check_recording(Recording(tuple(runs)))
    assert {fault.kind for fault in found.faults} == {"unsettled start"}
    np.testing.assert_allclose(found.noise, 0.02, rtol=0.05)


def read_with_noise(recording: Recording, rng, noise: float, *, followed: bool) -> Recording:
    """The same with noise of the drive, which the response follows or which its reading has."""
    runs = []
    for run in recording.runs:
        off = noise * rng.standard_normal(run.drive.size)
        drive = dataclasses.replace(run.drive, value=run.drive.value + off)
        runs.append(Run(drive, run.response + (11.0 * off if followed else 0.0), run.name))
    return Recording(tuple(runs))


@pytest.mark.parametrize("followed", [False, True])
def test_noise_of_the_drive_hides_no_start_that_is_refused(followed):
    rng = np.random.default_rng(4)
    runs = []
    for run in recorded(rng, white).runs:
        start = 0.1 * run.span * np.exp(-run.drive.time * run.drive.rate / 0.2)
        runs.append(dataclasses.replace(run, response=run.response + start))
    found = check_recording(read_with_noise(Recording(tuple(runs)), rng, 0.03, followed=followed))
    kinds = [(fault.kind, fault.run) for fault in found.faults]
    assert {name for kind, name in kinds if kind == "unsettled start"} == {
        "run00",
        "run01",
        "run02",
    }
    assert ("noisy drive" in dict(kinds)) == (not followed)
    assert [run.settled for run in found.runs] == [False] * 3


def test_noise_of_the_drive_s_reading_hides_no_lag_that_starts_from_rest():
    rng = np.random.default_rng(1)
    recording = recorded(rng, white, settled=False)
    found = check_recording(read_with_noise(recording, rng, 0.02, followed=False))
    assert {fault.kind for fault in found.faults} == {"noisy drive"}
    assert ASKED in [question.name for question in found.questions]
    for run in found.runs:  # not inflated by the first period
        np.testing.assert_allclose(run.noise, 0.02, rtol=0.08)


@pytest.mark.parametrize("followed", [False, True])
@pytest.mark.parametrize("periods", [2, 3, 5])
def test_noise_of_the_drive_accuses_no_settled_run(periods, followed):
    for seed in range(10):
        rng = np.random.default_rng(seed)
        noisy = read_with_noise(recorded(rng, white, periods=periods), rng, 0.05, followed=followed)
        assert [first_period_miss(run) for run in noisy.runs] == [0.0] * 3


def test_of_two_periods_the_settled_one_tells_the_noise():
    runs = []
    for run in recorded(np.random.default_rng(4), white, periods=2).runs:
        start = 0.05 * run.span * np.exp(-run.drive.time / LAG_S)
        runs.append(dataclasses.replace(run, response=run.response + start))
    found = check_recording(Recording(tuple(runs)))
    assert {fault.kind for fault in found.faults} == {"unsettled start"}
    np.testing.assert_allclose(found.noise, 0.02, rtol=0.05)
    because = {question.name: question for question in found.questions}["the noise"].because
    assert because.startswith("only one settled period")


def test_the_noise_of_a_fit_and_of_the_line_before_it_leave_an_unsettled_period_out():
    recording = recorded(np.random.default_rng(1), white, settled=False)
    assert find_late_starts(recording.runs) == {"run00", "run01", "run02"}
    assert find_late_starts(recorded(np.random.default_rng(1), white).runs) == set()
    assert "noise 20 MHz rms" in describe_recording(recording, 10.0)
    ecdl = ECDL(RAPI.guess(recording))
    problem = Posed.of(ecdl, recording, None, "uniform", history=True, drift=False).problem
    errors = np.zeros(problem.data.use.shape)  # a run is as long as the longest, or longer
    for row, run in enumerate(recording.runs):
        errors[row, : run.drive.size] = 11.0 * run.drive.value - run.response
    np.testing.assert_allclose(measure_noise(problem, errors).rms, 0.02, rtol=0.08)


def test_the_size_is_that_of_what_decays():
    recording = recorded(np.random.default_rng(1), white, settled=False, noise=1e-3)
    run = recording.runs[0]
    one = compare_periods(run)[0]
    time = run.drive.time[run.drive.period == 0]
    decay = LAG_SHARE * run.span * np.exp(-time / LAG_S)
    np.testing.assert_allclose(one.rms, np.std(decay), rtol=0.1)


def test_nothing_is_asked_of_settled_or_short_runs():
    rng = np.random.default_rng(2)
    assert ASKED not in [q.name for q in check_recording(recorded(rng, white)).questions]
    short = recorded(rng, white, settled=False, periods=2)
    assert all(compare_periods(run) == [] for run in short.runs)


def test_a_steady_drift_and_a_rate_that_is_slightly_off_are_no_settling():
    rng = np.random.default_rng(6)
    assert find_unsettled(recorded(rng, white, drift=3.0, periods=6).runs) == []
    slow = []
    for run in recorded(rng, white, periods=6).runs:
        late = np.interp(run.drive.time * 0.9999, run.drive.time, run.response)
        slow.append(dataclasses.replace(run, response=late))
    assert find_unsettled(slow) == []


def test_readings_without_noise_that_repeat_are_settled():
    assert find_unsettled(recorded(np.random.default_rng(0), white, noise=0.0).runs) == []
