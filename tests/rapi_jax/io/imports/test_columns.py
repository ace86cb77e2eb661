"""What an import asks of columns, and columns that cannot be what they are taken for."""

import re
import shlex

import numpy as np
import pytest
from scope_files import scanned

from rapi_jax import DataError
from rapi_jax.internal import OpenQuestion
from rapi_jax.io import ImportOptions, MadeDrive, import_recording
from rapi_jax.io.imports.columns._command import import_command

T, U, Y = scanned((10.0, 3, 4.5), (20.0, 3, 4.5), sample_hz=2000.0)
PLAIN = {"drive_unit": "V", "response_unit": "GHz"}


def table(folder, names="", columns=(T, U, Y)):
    """A file of these columns, under `names` or without any."""
    lines = [",".join(f"{x:.7g}" for x in row) for row in np.stack(columns, 1).tolist()]
    path = folder / "a.csv"
    path.write_text("\n".join([*([names] if names else []), *lines, ""]), encoding="utf-8")
    return path


def asked(path, **options) -> str:
    """The question that an import asks."""
    with pytest.raises(OpenQuestion) as error:
        import_recording(path, ImportOptions(**options))
    return str(error.value)


def line_of(text: str) -> list[str]:
    """The command in a question, in words, without what is said after the file."""
    (line,) = re.findall(r"`(rapi import [^`]*)`", text)
    return shlex.split(line)[3:]


@pytest.mark.parametrize(
    ("names", "options", "line"),
    [
        ("time,a,b", {}, "--drive a --response b --drive-unit V --response-unit GHz"),
        ("time,a (mV),b (um)", {}, "--drive a --response b"),
        ("time (s),b (um),a (V)", {}, "--drive a --response b"),
        ("time (s),a (V),b (V)", {"response": "a"}, "--drive b --response a"),
        ("", {}, "--time 0 --drive 1 --response 2 --drive-unit V --response-unit GHz"),
        ("time (s),a (V),b (V)", {"fringes": "b"},
         "--drive a --fringes b --interferometer '40.8 MHz'"),
    ],
)  # fmt: skip
def test_a_question_ends_with_a_line_of_the_columns_of_the_file(tmp_path, names, options, line):
    text = asked(table(tmp_path, names), **options)
    assert line_of(text) == [*shlex.split(line), "-o", "my-recording"]
    assert "Columns, by number or name: 0" in text and "For example" in text


def test_the_example_takes_the_smooth_column_for_the_drive_and_another_unit_for_the_response(
    tmp_path,
):
    """As of a sine that was sent, behind what it moved; of two voltages and a polarisation."""
    noisy = Y + 0.05 * np.random.default_rng(0).standard_normal(Y.size)
    line = line_of(asked(table(tmp_path, "time,moved,sent", (T, noisy, U))))
    assert line[:4] == ["--drive", "sent", "--response", "moved"]
    nameless = line_of(asked(table(tmp_path, "", (T, noisy, U))))
    assert nameless[:6] == ["--time", "0", "--drive", "2", "--response", "1"]
    names = "time (s),V+ (V),V- (V),P (uC/cm2)"
    line = line_of(asked(table(tmp_path, names, (T, U, U, Y))))
    assert line[:4] == ["--drive", "V+", "--response", "P"]
    alike = np.roll(noisy, 7)  # nothing tells: the first is shown
    line = line_of(asked(table(tmp_path, "time,a,b", (T, alike, noisy))))
    assert line[:4] == ["--drive", "a", "--response", "b"]


def test_without_a_clock_or_a_drive_the_example_says_how_they_are_made(tmp_path):
    path = table(tmp_path, "reading", (Y,))
    assert line_of(asked(path)) == shlex.split(
        "--response reading --drive-unit V --response-unit GHz --sample-rate 10000 "
        "--drive-amplitude 4.5 --drive-rate 10 --drive-offset 3 -o my-recording"
    )
    assert "--sample-rate 10000" in asked(table(tmp_path, "u (V),y (V)", (U, Y)))


def test_the_line_of_an_import_says_all_that_is_no_default():
    options = ImportOptions(
        drive="a b", drive_scale=-2.5, drive_unit="V", rates=(10.0, 12.5), cut=False,
        response="-y", units_checked=True, response_lag_s=1e-4, temperature_c="21.5",
    )  # fmt: skip
    assert import_command(["x y.csv", "z.csv"], options) == (
        "rapi import 'x y.csv' z.csv --drive 'a b' --response=-y --drive-unit V --drive-scale -2.5 "
        "--rate 10 --rate 12.5 --no-cut --response-lag 0.0001 --temperature 21.5 --units-checked"
    )
    assert import_command(["a"], ImportOptions(made=MadeDrive(1.0, 1e6, phase=0.25))) == (
        "rapi import a --drive-amplitude 1 --drive-rate 1e+06 --drive-phase 0.25"
    )


EXCHANGED = {
    "time and drive": ("", {"time": "1", "drive": "0", "response": "2"}, ("0", "1", "2")),
    "time and response": ("", {"time": "2", "drive": "1", "response": "0"}, ("0", "1", "2")),
    "time and drive, by their units": (
        "t0 (ms),a (V),b (um)", {"time": "a", "drive": "0", "response": "b"}, ("time", "a", "b"),
    ),
    "drive and response, by their units": (
        "time (ms),a (V),b (GHz)", {"drive": "b", "response": "a"}, (None, "a", "b"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", EXCHANGED)
def test_exchanged_columns_are_asked_for_with_the_right_ones(tmp_path, name):
    names, given, right = EXCHANGED[name]
    units = {} if names else PLAIN
    path = table(tmp_path, names)
    text = asked(path, **given, **units)
    assert "Most likely" in text
    words = line_of(text)
    likely = tuple(
        words[words.index(f"--{what}") + 1] if f"--{what}" in words else None
        for what in ("time", "drive", "response")
    )
    assert likely == right
    found = dict(zip(("time", "drive", "response"), likely, strict=True))
    made = import_recording(path, ImportOptions(**(given | found), **units, units_checked=True))
    assert len(made.recording.runs) == 2  # 10 and 20 Hz


def test_a_time_is_no_response(tmp_path):
    path = table(tmp_path)
    assert "rises evenly" in asked(path, sample_rate=2000.0, drive="1", response="0", **PLAIN)
    path = table(tmp_path, "time,a,b")
    text = asked(path, drive="a", response="time", **PLAIN)
    assert "by its name it is the time" in text and "--response b" in text


def test_a_drive_that_rises_like_a_time_is_remarked_and_a_ramp_of_one_sweep_is_not(tmp_path):
    path = table(tmp_path)
    options = ImportOptions(sample_rate=2000.0, drive="0", response="2", **PLAIN)
    (note,) = (n for n in import_recording(path, options).notes if "rises evenly" in n)
    assert "If it is a time, name another column by --drive" in note
    ramp = table(tmp_path, "", (T, 5.0 * T, 70.0 * T + T**2))
    options = ImportOptions(time="0", drive="1", response="2", **PLAIN)
    assert "rises evenly" not in " ".join(import_recording(ramp, options).notes)


@pytest.mark.parametrize("noise", [0.0, 0.02])  # of the response's span
def test_a_drive_that_does_not_repeat_beside_a_response_that_does_is_remarked(tmp_path, noise):
    rng = np.random.default_rng(0)
    wander = np.cumsum(rng.standard_normal(T.size))
    y = Y + noise * np.ptp(Y) * rng.standard_normal(T.size)
    options = ImportOptions(time="0", drive="1", response="2", **PLAIN, units_checked=True)
    made = import_recording(table(tmp_path, "", (T, wander, y)), options)
    (note,) = (note for note in made.notes if "another column is the drive" in note)
    assert "the response of run00 does, at 10 Hz" in note
    for pair in ((U, y), (wander, np.cumsum(rng.standard_normal(T.size)))):
        made = import_recording(table(tmp_path, "", (T, *pair)), options)
        assert "another column is the drive" not in " ".join(made.notes)


def test_records_below_each_other_are_not_taken_for_a_wrong_time(tmp_path):
    twice = [np.r_[one, one] for one in (T, U, Y)]
    path = table(tmp_path, "", (*twice, np.arange(2 * T.size)))
    with pytest.raises(DataError, match="Several records stand below each other"):
        import_recording(path, ImportOptions(time="0", drive="1", response="2", **PLAIN))


def test_what_is_assumed_of_units_and_times_is_said_and_written(tmp_path):
    path = table(tmp_path, "time (s),a (V),b (mV)")
    options = ImportOptions(drive="a", response="b", sample_rate=2000.0)
    made = import_recording(path, options)
    volts, times = (note for note in made.notes if "assumed: " in note)
    assert "the response is a voltage in mV, the unit of its column 'b (mV)'" in volts
    assert "2000 Hz as --sample-rate says; all times are made from it" in times
    assert "the times in column 'time (s)' are not used" in times
    written = made.recording.provenance.values()
    assert volts in written and times in written
    stated = import_recording(path, ImportOptions(drive="a", response="b", response_unit="mV"))
    assert "assumed: " not in " ".join(stated.notes)


@pytest.mark.parametrize("noise", [0.0, 1e-3])  # V
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_drive_that_rests_between_runs_is_not_called_clipped(tmp_path, sign, noise):
    """At rest at its lowest or highest value before, between and after runs of three periods."""
    rest, middle = 500, int(T.searchsorted(0.3))
    u, y = (
        np.concatenate([still, one[:middle], still, one[middle:], still])
        for one in (sign * U, sign * Y)
        for still in (np.full(rest, one[0]),)
    )
    t = np.arange(u.size) / 2000.0
    noisy = u + noise * np.random.default_rng(0).normal(size=u.size)
    options = ImportOptions(time="0", drive="1", response="2", **PLAIN)
    without = import_recording(table(tmp_path, "", (T, sign * U, sign * Y)), options)
    made = import_recording(table(tmp_path, "", (t, noisy, y)), options)
    assert [run.drive.excitation_hz for run in made.recording.runs] == [10.0, 20.0]
    periods = [run.drive.periods for run in without.recording.runs]
    assert [run.drive.periods for run in made.recording.runs] == periods
    assert "flat" not in " ".join(made.notes)
    top = float(np.quantile(sign * U, 0.8))
    made = import_recording(table(tmp_path, "", (t, np.minimum(u, top), y)), options)
    (note,) = (note for note in made.notes if "flat" in note)
    assert "the drive is flat at its extreme for up to" in note and "within run00, run01" in note
    first = int(re.findall(r"samples (\d+)-", note)[0])
    assert u[first] >= top  # counted in the record, not in the run
