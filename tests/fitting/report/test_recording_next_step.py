"""The command that comes after a recording was checked."""

import dataclasses
import re
import shlex

import numpy as np
import pytest
from scope_files import put, rows, scanned

from fitting import check_recording
from fitting.report.recording_check._next_step import describe_next
from rapi_jax import Recording
from rapi_jax.io import import_recording

RATES = ((10.0, 3, 4.5), (20.0, 3, 4.5), (40.0, 4, 4.5))
T, U, Y = scanned(*RATES, sample_hz=8000.0)
IMPORT = "rapi import scope.csv --drive a --response b"


def from_rest(y, settling=5.0):
    """A response whose first period begins away from where its drive brings it."""
    late = y.copy()
    late[:800] -= settling * np.exp(-np.arange(800) / 160.0)
    return late


def written(tmp_path, u=U, y=Y, **options):
    """A recording imported from a file of these columns, and checked."""
    from rapi_jax.io import ImportOptions

    path = put(tmp_path / "scope.csv", "t,a,b\n" + rows(T, u, y))
    known = ImportOptions(
        drive="a", response="b", drive_unit="V", response_unit="GHz", time_unit="s", **options
    )
    return check_recording(import_recording(path, known).recording)


def step(check, **more) -> str:
    made = check.recording.provenance.get("import_command")
    return describe_next(check, **{"source": "r", "again": made, "output": "r"} | more)


def test_a_sound_recording_is_fitted_or_written_first(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check = written(tmp_path)
    assert step(check) == "Next: `rapi fit r -o result`"
    assert step(check, source="a b") == "Next: `rapi fit 'a b' -o result`"
    line = step(check, source=None, again=IMPORT)
    assert line == f"Next: `{IMPORT} -o r`"


@pytest.mark.parametrize("settling", [5.0, 0.3])  # GHz: a fault; less is told
def test_a_first_period_from_rest_is_left_out_by_the_next_import(tmp_path, monkeypatch, settling):
    monkeypatch.chdir(tmp_path)
    check = written(tmp_path, y=from_rest(Y, settling))
    assert check.unsettled == ("run00",) and check.sound == (settling < 1.0)
    line = step(check)
    assert line.startswith(
        "Next, without the first period of each run, since run00 had not settled"
    )
    words = shlex.split(re.findall("`(.*)`", line)[0])
    assert words[:3] == ["rapi", "import", "scope.csv"]
    assert words[-4:] == ["--skip-periods", "1", "-o", "r"]
    after = written(tmp_path, y=from_rest(Y, settling), skip_periods=1)
    assert after.unsettled == () and step(after) == "Next: `rapi fit r -o result`"


def test_of_a_skipped_period_too_few_one_more_is_skipped(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    slow = Y.copy()
    slow[800:1600] = from_rest(Y[800:])[:800]
    line = step(written(tmp_path, y=slow, skip_periods=1))
    assert "without the first 2 periods of each run" in line and "--skip-periods 2 -o r" in line
    assert line.count("--skip-periods") == 1


def test_a_run_of_one_period_has_none_to_be_left_out(tmp_path):
    """The step then names no command, since that one would be refused."""
    check = written(tmp_path, y=from_rest(Y))
    short = check.recording.runs[2]
    size = int(round(1.0 / (short.drive.rate * short.drive.step_s)))
    time, value = short.drive.time[:size], short.drive.value[:size]
    drive = dataclasses.replace(short.drive, time=time, value=value)
    one = dataclasses.replace(short, drive=drive, response=short.response[:size])
    runs = (*check.recording.runs[:2], one)
    with_one = check_recording(dataclasses.replace(check.recording, runs=runs))
    assert with_one.unsettled == ("run00",)
    assert step(with_one).startswith("Next: mend what is marked with x")


def test_noise_of_the_drive_and_exchanged_columns_name_their_option(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    noisy = written(tmp_path, u=U + 5e-3 * rng.standard_normal(U.size))
    assert {fault.kind for fault in noisy.faults} == {"noisy drive"}
    assert "--drive-as fitted -o r`" in step(noisy)
    swapped = written(tmp_path, u=Y + rng.standard_normal(U.size), y=U)
    assert {fault.kind for fault in swapped.faults} == {"columns swapped"}
    line = step(swapped)
    assert "if drive and response are exchanged" in line and "--drive b --response a" in line
    apart = step(swapped, again=f"{IMPORT} --drive-file b.csv")
    assert apart.startswith("Next: mend what is marked with x")


def test_two_faults_with_an_option_each_are_mended_by_one_import(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(0)
    u, y = U + 5e-3 * rng.standard_normal(U.size), from_rest(Y)
    both = written(tmp_path, u=u, y=y)
    assert {fault.kind for fault in both.faults} == {"noisy drive", "unsettled start"}
    line = step(both)
    assert "run00 had not settled, and with a drive that is free of noise: `rapi import" in line
    assert line.endswith("--skip-periods 1 --drive-as fitted -o r`")
    after = written(tmp_path, u=u, y=y, skip_periods=1, drive_as="fitted")
    assert step(after) == "Next: `rapi fit r -o result`"


def test_columns_that_a_note_calls_exchanged_are_not_sent_to_a_fit_alone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check = written(tmp_path)
    swapped = dataclasses.replace(check, notes=("columns: Most likely swapped.",))
    assert not check.swapped and swapped.sound and swapped.swapped
    line = step(swapped)
    assert line.startswith("Next, if drive and response are exchanged: `rapi import")
    assert line.endswith(
        "; if not: `rapi fit r -o result`; if the drive is one that `rapi compensate` made: "
        "`rapi fit r --check DRIVES`"
    )


def test_a_file_that_is_elsewhere_is_named_and_other_lines_are_not_copied(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    check = written(tmp_path, y=from_rest(Y))
    (tmp_path / "scope.csv").unlink()
    line = step(check)
    assert "where scope.csv is, without the first period" in line
    assert line.endswith(f"-o {tmp_path / 'r'}`")
    for foreign in (None, "rm -r r", "rapi import 'r", "rapi import r\n"):
        assert step(check, again=foreign).startswith("Next: mend what is marked with x")
    quoted = step(check, again="rapi import a.csv; rm -r r")
    assert "rapi import 'a.csv;' rm -r r" in quoted


def test_a_recording_that_no_import_wrote_has_a_fit_or_faults(tmp_path):
    check = written(tmp_path, y=from_rest(Y, 0.3))
    own = check_recording(
        Recording(check.recording.runs, response_unit="GHz", drive_unit="V", provenance={})
    )
    assert step(own) == "Next: `rapi fit r -o result`"
