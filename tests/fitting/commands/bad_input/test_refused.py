"""Recordings that are refused: exit code 3, and one line that says what, where and what to do."""

import pytest
from bad_input import (
    append,
    bomb,
    cut,
    data,
    doubled,
    dropped,
    edit,
    entry,
    european,
    external,
    files,
    flipped,
    head,
    jittered,
    linked_out,
    netcdf,
    put,
    ragged,
    repeated,
    rewrite,
    scale,
    shifted,
    short,
    sparse,
    swapped,
    truncated,
    weak,
)
from bad_rows import MASK, Row, check_row

NAN, INF = float("nan"), float("inf")


ROWS = (
    Row(
        "NaN in a reading",
        data(put(1, 2, 57, NAN)),
        3,
        ("run01.csv", "`response`", "1 value", "sample 57", "--nan mask"),
    ),
    Row(
        "Inf in a reading",
        data(put(0, 2, 9, -INF)),
        3,
        ("run00.csv", "`response`", "-inf", "sample 9"),
    ),
    Row(
        "NaN in the drive",
        data(put(2, 1, slice(4, 7), NAN)),
        3,
        ("run02.csv", "`drive`", "3 value", "sample 4", "again"),
    ),
    Row(
        "Inf in the drive",
        data(put(2, 1, 199, INF)),
        3,
        ("run02.csv", "`drive`", "inf", "sample 199"),
    ),
    Row("NaN in the clock", data(put(3, 0, 20, NAN)), 3, ("run03.csv", "`time_s`", "sample 20")),
    Row(
        "Inf in the clock",
        data(put(3, 0, 199, INF)),
        3,
        ("run03.csv", "`time_s`", "inf", "sample 199"),
    ),
    Row(
        "NaN in the drive, masked",
        data(put(2, 1, 4, NAN)),
        3,
        ("run02.csv", "`drive`", "never guessed"),
        MASK,
    ),
    Row(
        "no reading left after the mask",
        data(put(1, 2, slice(None), NAN)),
        3,
        ("run01.csv", "0 finite", "leave this run out"),
        MASK,
    ),
    Row("empty CSV", files(rewrite("run00.csv", b"")), 3, ("run00.csv", "the file is empty")),
    Row(
        "header only",
        files(rewrite("run00.csv", b"time_s,drive,response\n")),
        3,
        ("run00.csv", "no samples", "again"),
    ),
    Row("two samples", data(cut(2)), 3, ("run00.csv", "at least 3 samples", "has 2", "again")),
    Row(
        "fewer samples than parameters",
        data(short),
        3,
        ("8 usable samples", "parameters", "Record more"),
    ),
    Row(
        "no complete period",
        data(cut(60)),
        3,
        ("run00", "no complete period", "10 Hz", "excitation_hz"),
    ),
    Row(
        "samples out of order",
        data(swapped),
        3,
        ("run00.csv", "`time_s` goes back", "sample 51", "sort"),
    ),
    Row(
        "sample twice", data(repeated), 3, ("run00.csv", "`time_s` repeats", "sample 51", "remove")
    ),
    Row("jitter", data(jittered), 3, ("run00.csv", "jitters", "the usual one", "digits")),
    Row(
        "samples dropped",
        data(dropped),
        3,
        ("run00.csv", "3 sample(s) are missing after sample 79", "record again"),
    ),
    Row(
        "clock does not start at 0",
        data(shifted(5.0)),
        3,
        ("run00.csv", "starts at 5 s", "start_s"),
    ),
    Row(
        "clock beyond all bounds",
        data(scale(0, 1e300)),
        3,
        ("run00", "`time_s` ends at 1.99e+299 s", "unit"),
    ),
    Row(
        "a column shorter than the others",
        files(append("run01.csv", b"0.2,3.0\n")),
        3,
        ("run01.csv", "line 202", "2 value(s)", "cut short"),
    ),
    Row(
        "a response shorter than its drive",
        netcdf(ragged),
        3,
        ("recording.nc", "run01", "199 samples", "200"),
    ),
    Row(
        "rate in kHz",
        data(entry(excitation_hz=0.01)),
        3,
        ("run00", "no complete period", "0.01 Hz", "excitation_hz"),
    ),
    Row(
        "drive in mV called V",
        data(scale(1, 1e3)),
        3,
        ("run00", "drive", "outside", "likely in mV"),
    ),
    Row("drive in V called mV", data(head(drive_unit="mV")), 3, ("run00", "called mV")),
    Row(
        "reading in GHz called Hz",
        data(head(response_unit="Hz")),
        3,
        ("run00", "response", "called MHz or Hz"),
    ),
    Row("reading in GHz called MHz", data(weak), 3, ("run00", "response", "GHz was called MHz")),
    Row("reading in Hz called GHz", data(scale(2, 1e9)), 3, ("run00", "likely in Hz")),
    Row("reading in MHz called GHz", data(scale(2, 1e3)), 3, ("run00", "likely in MHz")),
    Row(
        "no response unit",
        data(head(response_unit=None)),
        3,
        ("manifest.toml", "`response_unit` is missing", "No unit is assumed"),
    ),
    Row(
        "no drive unit",
        data(head(drive_unit=None)),
        3,
        ("manifest.toml", "`drive_unit` is missing", "No unit is assumed"),
    ),
    Row(
        "unknown unit",
        data(head(response_unit="THz")),
        3,
        ("manifest.toml", "`response_unit`", "GHz", "THz"),
    ),
    Row(
        "unknown waveform",
        data(entry(waveform="sawtooth")),
        3,
        ("manifest.toml", "run.0.waveform", "triangle"),
    ),
    Row(
        "no schema",
        data(head(schema=None)),
        3,
        ("manifest.toml", "`schema` is missing", "rapi.recording/1"),
    ),
    Row(
        "another schema",
        data(head(schema="rapi.recording/9")),
        3,
        ("manifest.toml", "rapi.recording/1", "rapi.recording/9"),
    ),
    Row(
        "misspelt key",
        edit("manifest.toml", "excitation_hz", "excitaton_hz"),
        3,
        ("manifest.toml", "excitaton_hz", "`excitation_hz` meant"),
    ),
    Row(
        "not TOML",
        edit("manifest.toml", "[[run]]", "[[run]"),
        3,
        ("manifest.toml", "not valid TOML", "line"),
    ),
    Row("no manifest", files(lambda f: (f / "manifest.toml").unlink()), 3, ("no manifest.toml",)),
    Row(
        "no run",
        files(
            rewrite(
                "manifest.toml",
                b'schema = "rapi.recording/1"\nresponse_unit = "GHz"\ndrive_unit = "V"\n',
            )
        ),
        3,
        ("manifest.toml", "`run` is missing", "[[run]]"),
    ),
    Row(
        "a CSV file is missing",
        files(lambda f: (f / "run02.csv").unlink()),
        3,
        ("run02.csv", "no such file"),
    ),
    Row(
        "a path out of the folder",
        edit("manifest.toml", "run00.csv", "../run00.csv"),
        3,
        ("manifest.toml", "../run00.csv", "inside the recording"),
    ),
    Row(
        "an absolute path",
        edit("manifest.toml", "run00.csv", "/etc/passwd"),
        3,
        ("manifest.toml", "/etc/passwd", "inside the recording"),
    ),
    Row(
        "a link out of the folder",
        files(linked_out),
        3,
        ("run00.csv", "link out of the recording", "Copy"),
    ),
    Row(
        "two runs of one name",
        data(entry(1, name="run00")),
        3,
        ("manifest.toml", "same name", "run00"),
    ),
    Row(
        "rate zero",
        data(entry(excitation_hz=0.0)),
        3,
        ("manifest.toml", "run.0.excitation_hz", "greater than 0", "is 0.0"),
    ),
    Row(
        "rate negative",
        data(entry(excitation_hz=-10.0)),
        3,
        ("manifest.toml", "run.0.excitation_hz", "greater than 0", "is -10.0"),
    ),
    Row("rate NaN", data(entry(excitation_hz=NAN)), 3, ("manifest.toml", "run.0.excitation_hz")),
    Row(
        "rate as text",
        data(entry(excitation_hz="10 Hz")),
        3,
        ("manifest.toml", "run.0.excitation_hz", "number"),
    ),
    Row(
        "latency longer than a run",
        data(head(response_lag_s=5.0)),
        3,
        ("run00", "`response_lag_s` = 5 s", "short beside"),
    ),
    Row(
        "latency negative",
        data(head(response_lag_s=-0.001)),
        3,
        ("manifest.toml", "response_lag_s", "0"),
    ),
    Row("netCDF cut short", netcdf(truncated), 3, ("recording.nc", "damaged or cut short", "copy")),
    Row("netCDF with a flipped bit", netcdf(flipped), 3, ("recording.nc", "damaged", "copy")),
    Row(
        "netCDF with an external link",
        netcdf(external),
        3,
        ("recording.nc", "/run01", "external link"),
    ),
    Row("netCDF that declares too much", netcdf(bomb), 3, ("recording.nc", "declares", "at most")),
    Row("netCDF of no bytes", netcdf(lambda p: p.write_bytes(b"")), 3, ("recording.nc", "empty")),
    Row(
        "text called netCDF",
        netcdf(lambda p: p.write_bytes(b"hello")),
        3,
        ("recording.nc", "neither a netCDF-4 file"),
    ),
    Row("CSV that declares too much", files(sparse), 3, ("run00.csv", "bytes, but at most")),
    Row("a column twice", files(doubled), 3, ("run00.csv", "line 1", "twice")),
    Row(
        "columns in another order",
        edit("run00.csv", "time_s,drive,response", "time_s,response,drive"),
        3,
        ("run00.csv", "line 1", "time_s,drive,response"),
    ),
    Row("decimal commas", files(european), 3, ("run00.csv", "line 1")),
    Row(
        "text for a number",
        edit("run00.csv", "\n0.0,", "\noverload,"),
        3,
        ("run00.csv", "line 2", "`time_s`", "'overload'"),
    ),
    Row(
        "not UTF-8",
        files(append("manifest.toml", b'note = "\xb5m"\n')),
        3,
        ("manifest.toml", "not UTF-8", "byte"),
    ),
    Row(
        "NUL bytes", files(append("run00.csv", b"\0\0\0\0")), 3, ("run00.csv", "NUL bytes", "crash")
    ),
    Row(
        "escape sequence in a run's name",
        data(entry(name="\\u001b[2Jrun")),
        3,
        ("\\x1b[2Jrun", "cannot name a run"),
    ),
    Row("path in a run's name", data(entry(name="../run")), 3, ("../run", "cannot name a run")),
)


@pytest.mark.fault(
    name=lambda row: row.name,
    promise=lambda row: "exit 3, one line: " + ", ".join(row.words) if row.code else "exit 0",
    seed=7,
)
@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.name)
def test_recording(row, rapi, tmp_path):
    check_row(row, rapi, tmp_path)
