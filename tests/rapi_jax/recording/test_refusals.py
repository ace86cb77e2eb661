"""Drives, runs and recordings that cannot be used are refused with their place."""

import dataclasses

import numpy as np
import pytest
from periodic_drives import periodic

from rapi_jax import DataError, Drive, Recording, Run

TIME = np.arange(20) * 0.01


def changed(index, value, base=TIME):
    return np.concatenate([base[:index], [value], base[index + 1 :]])


BAD_DRIVES = {
    "NaN drive": (dict(value=changed(7, np.nan)), r"`drive` has 1 value.*nan.*sample 7"),
    "infinite drive": (dict(value=changed(3, np.inf)), r"`drive`.*inf.*sample 3"),
    "NaN clock": (dict(time=changed(4, np.nan)), r"`time_s` has 1 value.*sample 4"),
    "doubled": (dict(time=changed(5, 0.04)), r"`time_s` repeats at sample 5"),
    "unsorted": (dict(time=changed(5, 0.035)), r"`time_s` goes back at sample 5"),
    "reversed": (dict(time=TIME[::-1]), r"`time_s` goes back at sample 1"),
    "jitter": (dict(time=changed(9, 0.094)), r"jitters: the step after sample 8"),
    "gap": (
        dict(time=np.delete(np.arange(23) * 0.01, [12, 13, 14])),
        r"about 3 sample.*after sample 11.*1 gap",
    ),
    "two rates": (
        dict(time=np.r_[TIME, 0.19 + np.arange(1, 31) * 0.02], value=np.ones(50)),
        r"several sampling rates: every 0.01 s from 0 s, then every 0.02 s from 0.19 s.*no jitter",
    ),
    "three rates, the first again": (
        dict(time=np.cumsum(np.r_[0.0, np.repeat([0.01, 0.013, 0.01], 40)]), value=np.ones(121)),
        r"several sampling rates: .*every 0.013 s from 0.4 s, then every 0.01 s from 0.92 s",
    ),
    "late start": (dict(time=TIME + 5.0), r"starts at 5 s"),
    "early start": (dict(time=TIME - 5.0), r"starts at -5 s"),
    "two columns": (dict(value=np.ones((20, 2))), r"`drive` must be one column.*\(20, 2\)"),
    "unequal": (dict(value=np.ones(19)), r"`time_s` has 20 samples, but `drive` has 19"),
    "short": (dict(time=TIME[:2], value=TIME[:2]), r"at least 3 samples"),
    "zero rate": (dict(excitation_hz=0.0), r"`excitation_hz`.*0"),
    "negative rate": (dict(excitation_hz=-5.0), r"`excitation_hz`.*-5"),
    "NaN rate": (dict(excitation_hz=float("nan")), r"`excitation_hz`.*nan"),
    "infinite rate": (dict(excitation_hz=float("inf")), r"`excitation_hz`.*inf"),
    "NaN start": (dict(start_s=float("nan")), r"`start_s`"),
}


@pytest.mark.parametrize("name", BAD_DRIVES)
def test_a_drive_that_cannot_be_used_is_refused_with_its_place(name):
    change, message = BAD_DRIVES[name]
    with pytest.raises(DataError, match=message):
        Drive(**{**dict(time=TIME, value=np.sin(TIME)), **change})


def test_small_jitter_and_rounded_times_are_accepted():
    jitter = 0.0008 * np.random.default_rng(0).uniform(-1, 1, 20) * (np.arange(20) > 0)
    assert Drive(TIME + jitter, np.sin(TIME)).size == 20
    rounded = np.round(np.arange(3000) / 30000, 6)  # 33.33 us with six digits
    assert Drive(rounded, rounded).size == 3000


def test_gaps_between_even_stretches_are_gaps():
    time = np.delete(np.arange(90) * 0.01, [30, 31, 60])
    with pytest.raises(DataError, match=r"about 2 sample.*after sample 29.*2 gap"):
        Drive(time, np.sin(time))


def test_a_run_must_match_its_drive():
    drive = periodic(50, 50.0)
    with pytest.raises(DataError, match=r"run 'r7'.*49 samples.*50"):
        Run(drive, np.ones(49), "r7")
    with pytest.raises(DataError, match="one column"):
        Run(drive, np.ones((50, 1)))


def test_a_recording_must_be_consistent():
    run = Run(periodic(50, 50.0), np.ones(50), "one")
    with pytest.raises(DataError, match="at least one run"):
        Recording(())
    with pytest.raises(DataError, match="same name.*one"):
        Recording((run, run))
    with pytest.raises(DataError, match="response_lag_s"):
        Recording((run,), response_lag_s=-1.0)
    with pytest.raises(ValueError, match="shorter"):
        Recording.of([run.drive, run.drive], [np.ones(50)])


def test_a_ragged_recording():
    drives = [periodic(n, n / 2, hz=hz) for n, hz in ((60, 20.0), (100, 10.0), (84, 10.0))]
    half = dataclasses.replace(drives[1], value=0.5 * drives[1].value)
    recording = Recording.of([*drives, half], [2.0 * d.value for d in [*drives, half]])
    assert [run.name for run in recording.runs] == ["run00", "run01", "run02", "run03"]
    assert recording.rates == [10.0, 20.0]
    assert recording.amplitudes == pytest.approx([2.0, 4.0], rel=0.02)
    assert [d.size for d in recording.drives] == [60, 100, 84, 100]


def test_the_hash_sees_every_number_and_its_meaning():
    recording = Recording.of([periodic(60, 30.0)], [np.arange(60.0)])
    again = Recording.of([periodic(60, 30.0)], [np.arange(60.0)])
    assert recording.sha256() == again.sha256()
    run = recording.runs[0]
    drive = run.drive
    runs = [
        dataclasses.replace(run, response=changed(5, 5.0 + 1e-12, run.response)),
        dataclasses.replace(run, name="other"),
        *(
            dataclasses.replace(run, drive=dataclasses.replace(drive, **change))
            for change in (
                dict(value=changed(5, 1.0, drive.value)),
                dict(time=1.01 * drive.time),
                dict(excitation_hz=10.5),
                dict(waveform="sine"),
                dict(start_s=1.0),
            )
        ),
    ]
    others = [dataclasses.replace(recording, runs=(r,)) for r in runs]
    fields = (
        dict(response_unit="um"),
        dict(drive_unit="um"),
        dict(response_origin="run"),
        dict(response_lag_s=1e-3),
    )
    others += [dataclasses.replace(recording, **change) for change in fields]
    assert len({r.sha256() for r in [recording, *others]}) == 1 + len(others)
