"""The exchange folder: round trips, units, and one line for everything that is wrong with it."""

import dataclasses
import os
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rapi_jax._errors import DataError
from rapi_jax.io import check_plausible, read_recording, write_recording
from rapi_jax.io._units import DRIVE_UNITS, RESPONSE_UNITS
from rapi_jax.io.recordings._build import check_nan_policy
from rapi_jax.io.recordings._folder import read_folder, write_folder
from rapi_jax.recording._drive import WAVEFORMS, Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._run import Run

HEAD = 'schema = "rapi.recording/1"\nresponse_unit = "GHz"\ndrive_unit = "V"\n'
RUN = '[[run]]\nfile = "a.csv"\n'
CSV = "time_s,drive,response\n0.0,1.0,10\n0.1,2.0,20\n0.2,3.0,30\n0.3,2.0,20\n"


def folder(where: Path, manifest: str = HEAD + RUN, csv: str | bytes = CSV) -> Path:
    """A folder with this manifest and `a.csv`."""
    (where / "manifest.toml").write_text(manifest, encoding="utf-8")
    (where / "a.csv").write_bytes(csv if isinstance(csv, bytes) else csv.encode())
    return where


def refused(path: Path, **options: str) -> str:
    """The one line with which the recording is refused."""
    with pytest.raises(DataError) as caught:
        read_recording(path, **options)
    said = str(caught.value)
    assert said.isprintable(), said
    assert len(said) < 600
    return said


def same(a: Recording, b: Recording) -> bool:
    """Whether two recordings agree in every bit, name and key."""
    return a.sha256() == b.sha256() and a.provenance == b.provenance


def test_round_trip_and_the_manifest_as_path(tmp_path, recording):
    write_recording(recording, tmp_path / "r")
    assert same(read_recording(tmp_path / "r"), recording)
    assert same(read_recording(tmp_path / "r" / "manifest.toml"), recording)
    assert sorted(os.listdir(tmp_path / "r")) == ["manifest.toml", "run00.csv", "run01.csv"]


def test_an_empty_folder_is_filled_and_a_full_one_updated(tmp_path, recording):
    (tmp_path / "r").mkdir()
    write_recording(recording, tmp_path / "r")
    (tmp_path / "r" / "LICENSE").write_text("mine")
    other = dataclasses.replace(recording, runs=recording.runs[:1], provenance={})
    write_recording(other, tmp_path / "r")
    back = read_recording(tmp_path / "r")
    assert same(back, other) and back.runs[0].name == "run01"
    names = sorted(os.listdir(tmp_path / "r"))
    assert len(names) == 3 and names[:2] == ["LICENSE", "manifest.toml"]


floats = st.floats(allow_nan=False, allow_infinity=False)
texts = st.text(max_size=30)
names = st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=8)


@st.composite
def fields(draw):
    """The fields of any recording; `build` makes it, as type checks draw numbers of their own."""
    runs = []
    for name in draw(st.lists(names, min_size=1, max_size=3, unique=True)):
        size = draw(st.integers(3, 12))
        clock = np.arange(size) * draw(st.floats(1e-9, 1e3))
        value = np.array(draw(st.lists(floats, min_size=size, max_size=size)))
        gaps = st.lists(floats | st.just(float("nan")), min_size=size, max_size=size)
        response = np.array(draw(gaps))
        response[:3] = 1 / 3  # at least three readings
        rate = draw(st.none() | st.floats(1e-6, 1e9))
        waveform = draw(st.sampled_from(WAVEFORMS))
        runs.append(((clock, value, rate, waveform, draw(floats)), response, name))
    return runs, {
        "response_unit": draw(st.sampled_from(["GHz", "um", "nm", "V"])),
        "drive_unit": draw(st.sampled_from(["V", "um"])),
        "response_origin": draw(st.sampled_from(["session", "run"])),
        "response_lag_s": draw(st.floats(0, 1)),
        "provenance": draw(st.dictionaries(texts, texts, max_size=3)),
    }


def build(runs, whole) -> Recording:
    """The recording of these fields."""
    return Recording(tuple(Run(Drive(*drive), y, name) for drive, y, name in runs), **whole)


@settings(deadline=None, max_examples=60)
@given(fields())
def test_round_trip_is_exact(drawn):
    recording = build(*drawn)
    with tempfile.TemporaryDirectory() as where:
        for _ in range(2):  # new, then over itself
            write_folder(recording, Path(where) / "r")
            assert same(read_folder(Path(where) / "r", nan="mask"), recording)


@pytest.mark.fault(name="generated text as CSV", promise="read, or refused in one line", trials=200)
@settings(deadline=None, max_examples=200)
@given(st.text(max_size=200) | st.binary(max_size=200))
def test_any_csv_is_read_or_refused_in_one_line(text):
    with tempfile.TemporaryDirectory() as where:
        for csv in (text, CSV.encode() + (text if isinstance(text, bytes) else text.encode())):
            path = folder(Path(where), csv=csv)
            try:
                read_recording(path)
            except DataError as error:
                assert str(error).isprintable()


@pytest.mark.fault(
    name="generated text as manifest", promise="read, or refused in one line", trials=200
)
@settings(deadline=None, max_examples=200)
@given(st.text(st.sampled_from("abrun[]{}=.,#\"'\\\n 019eTF"), max_size=60))
def test_any_manifest_is_read_or_refused_in_one_line(text):
    with tempfile.TemporaryDirectory() as where:
        for manifest in (text, HEAD + text, HEAD + RUN + text):
            try:
                read_recording(folder(Path(where), manifest))
            except DataError as error:
                assert str(error).isprintable()


@pytest.mark.parametrize("unit", DRIVE_UNITS)
def test_drives_are_converted(tmp_path, unit):
    manifest = HEAD.replace('"V"', f'"{unit}"').replace("GHz", "um") + RUN
    read = read_recording(folder(tmp_path, manifest))
    assert read.drive_unit == ("V" if unit == "mV" else unit)
    np.testing.assert_array_equal(
        read.runs[0].drive.value, np.array([1, 2, 3, 2.0]) / (1000 if unit == "mV" else 1)
    )


@pytest.mark.parametrize("unit", RESPONSE_UNITS)
def test_responses_are_converted(tmp_path, unit):
    size = {"MHz": 1e3, "Hz": 1e9}.get(unit, 1)
    csv = "time_s,drive,response\n" + "".join(f"0.{i},{i}.0,{10 * i * size}\n" for i in range(4))
    read = read_recording(folder(tmp_path, HEAD.replace("GHz", unit) + RUN, csv))
    assert read.response_unit == ("GHz" if unit.endswith("Hz") else unit)
    np.testing.assert_array_equal(read.runs[0].response, [0, 10, 20, 30])


def test_defaults_keys_of_others_and_columns_of_others(tmp_path):
    manifest = (
        HEAD + 'operator = "Kim"\ndate = 2020-01-02\nlist = [1]\n' + RUN + "note = 3\nx.y = 1\n"
    )
    csv = "\ufeff" + "".join(
        line + extra + "\r\n"
        for line, extra in zip(CSV.split(), [",target", ",", ",x", ",1", ",2"], strict=True)
    )
    read = read_recording(folder(tmp_path, manifest, csv))
    assert read.provenance == {"operator": "Kim", "date": "2020-01-02", "a.note": "3"}
    assert (read.response_origin, read.response_lag_s) == ("session", 0.0)
    drive = read.runs[0].drive
    assert (drive.excitation_hz, drive.waveform, drive.start_s) == (None, "other", 0.0)


BAD_MANIFESTS = {
    "": "`schema` is missing",
    'name = "other"\n[plugin]\nversion = 3\n': "the folder is probably another program's",
    HEAD: "`run` is missing: add one [[run]] table",
    HEAD + "run = []": "`run`",
    HEAD + "run = 3": "`run`",
    HEAD + "[run]\nfile = 'a.csv'": "`run`",
    HEAD + "[[run]]\n": "`run.0.file` is missing",
    HEAD.replace("/1", "/2") + RUN: '`schema` must be "rapi.recording/1"',
    HEAD.replace('drive_unit = "V"', "") + RUN: "`drive_unit` is missing: add one of V, mV, um",
    HEAD.replace('response_unit = "GHz"', "") + RUN: "missing: add one of GHz, MHz, Hz, um, nm, V",
    HEAD.replace("GHz", "THz") + RUN: "`response_unit` must be one of GHz, MHz, Hz, um, nm, V",
    HEAD.replace('"V"', '"\\u001bV"') + RUN: "`drive_unit` must be one of V, mV, um",
    HEAD.replace('"V"', "1") + RUN: "`drive_unit`",
    HEAD + "response_lag_s = -1\n" + RUN: "`response_lag_s`",
    HEAD + "response_lag_s = nan\n" + RUN: "`response_lag_s`",
    HEAD + 'response_lag_s = "1"\n' + RUN: "`response_lag_s`",
    HEAD + 'response_origin = "other"\n' + RUN: "`response_origin`",
    HEAD + RUN + "excitation_hz = 0": "`run.0.excitation_hz`",
    HEAD + RUN + "excitation_hz = true": "`run.0.excitation_hz`",
    HEAD + RUN + "exitation_hz = 10": "is `excitation_hz` meant?",
    HEAD + RUN + 'waveform = "square"': "`run.0.waveform`",
    HEAD + RUN + "start_s = inf": "`run.0.start_s`",
    HEAD + RUN + "samples = 2" + "9" * 3000: "`run.0.samples`",
    HEAD + RUN + 'name = "../x"': "cannot name a run",
    HEAD + RUN + RUN: "same name",
    HEAD + RUN + "[": "not valid TOML",
    HEAD + "a = " + "[" * 100_000: "not valid TOML",
    HEAD + "a." * 100_000 + "a = 1": "over 64 dots",
    HEAD + '#"\n' + "a." * 100 + 'a = """"""': "over 64 dots",
    HEAD + "provenance = 1\n" + RUN: "`provenance`",
}


@pytest.mark.fault(name="a manifest that is wrong", promise="refused in one line that names it")
@pytest.mark.parametrize(("manifest", "said"), BAD_MANIFESTS.items(), ids=range(len(BAD_MANIFESTS)))
def test_bad_manifests(tmp_path, manifest, said):
    start = time.perf_counter()
    line = refused(folder(tmp_path, manifest))
    assert said in line
    assert "manifest.toml" in line or "a.csv" in line
    assert time.perf_counter() - start < 5


BAD_CSV = {
    "time_s,drive,response,x,x\n0.0,1.0,10,1,2\n": "line 1 names a column twice",
    "": "line 1 must begin with time_s,drive,response, but is nothing: the file is empty",
    "time_s,drive,response\n": "has a header, but no samples",
    CSV.replace("drive", "voltage"): "line 1 must begin",
    CSV.replace(",", ";"): "It is separated by semicolons",
    CSV.split("\n", 1)[1]: "line 1 must begin",
    CSV + "0.4,1.0\n": "line 6 has 2 value(s), but the header names 3",
    CSV + "0.4,1.0,1,1\n": "line 6 has 4 value(s)",
    CSV + "0.4,1.0,1,": "line 6 has 4 value(s)",
    CSV.replace("0.2,", "\n0.2,"): "line 4 has 0 value(s)",
    CSV.replace("2.0,20", "2.0,", 1): "line 3: `response` must be a number, but is nothing",
    CSV.replace("2.0", "two", 1): "line 3: `drive` must be a number, but is 'two'",
    CSV.replace("2.0", "1_0", 1): "line 3: `drive` must be a number, but is '1_0'",
    CSV.replace("2.0", "\x1b[2J", 1): "line 3: `drive` must be a number, but is '\\x1b[2J'",
    CSV.replace("2.0", "nan", 1): "`drive` has 1 value(s) that are not finite",
    CSV.replace("2.0", "1e999", 1): "`drive` has 1 value(s) that are not finite",
    CSV.replace("0.2", "inf", 1): "`time_s` has 1 value(s) that are not finite",
    CSV.replace("20", "nan"): "`response` has 2 value(s) that are not finite, the first (nan) at",
    CSV.replace("0.2,", "0.1,"): "`time_s` repeats at sample 2",
    CSV.replace("0.2,", "0.05,"): "`time_s` goes back at sample 2",
    CSV.replace("0.3,", "0.9,"): "are missing after sample 2",
    CSV.replace("0.2,", "0.24,"): "`time_s` jitters",
    CSV[: CSV.index("0.2")]: "needs at least 3 samples",
    "\0" + CSV: "NUL bytes",
    CSV.encode("utf-16").decode("latin-1"): "NUL bytes",
    b"\xff\xfe" + CSV.encode(): "not UTF-8 text at byte 0",
}


@pytest.mark.fault(name="a CSV that is wrong", promise="refused in one line that names it")
@pytest.mark.parametrize(("csv", "said"), BAD_CSV.items(), ids=range(len(BAD_CSV)))
def test_bad_csv(tmp_path, csv, said):
    line = refused(folder(tmp_path, csv=csv))
    assert said in line and "a.csv: " in line


@pytest.mark.parametrize("name", ["r", "r.nc"])
def test_readings_said_to_be_masked_are_read_back_without_an_option(tmp_path, recording, name):
    runs = list(recording.runs)
    runs[1] = dataclasses.replace(runs[1], response=np.r_[np.nan, np.nan, runs[1].response[2:]])
    recording = dataclasses.replace(recording, runs=tuple(runs))
    for _ in range(2):  # new, then over itself
        write_recording(recording, tmp_path / name, masked=True)
        assert same(read_recording(tmp_path / name), recording)
    write_recording(recording, tmp_path / name)
    assert "2 value(s) that are not finite" in refused(tmp_path / name)


@pytest.mark.parametrize("said", [1, 3])
def test_gaps_of_another_number_than_is_said_are_refused(tmp_path, said):
    csv = CSV.replace("30", "nan").replace("10\n", "nan\n")
    line = refused(folder(tmp_path, f"{HEAD}{RUN}missing_readings = {said}\n", csv))
    assert f"the manifest says that {said} are missing" in line and "--nan mask" in line


def test_gaps_are_masked_on_request_and_never_in_the_drive(tmp_path):
    path = folder(tmp_path, csv=CSV.replace("30", "inf"))
    run = read_recording(path, nan="mask").runs[0]
    np.testing.assert_array_equal(run.response, [10, 20, np.nan, 20])
    assert "`drive` has 1" in refused(folder(tmp_path, csv=CSV.replace("3.0", "nan")), nan="mask")
    assert "only 2 finite" in refused(folder(tmp_path, csv=CSV.replace("20", "nan")), nan="mask")
    with pytest.raises(ValueError, match='must be "raise" or "mask"'):
        check_nan_policy("interpolate")


def scaled(drive: float, response: float) -> Recording:
    """A triangle with these spans, in V and GHz."""
    shape = np.array([0.0, 0.5, 1.0, 0.5, 0.0])
    return Recording.of([Drive(np.arange(5.0), drive * shape)], [response * shape])


@pytest.mark.fault(name="one unit called another", promise="refused")
@pytest.mark.parametrize(
    ("drive", "response", "said"),
    [
        (3.0, 75.0, None),
        (0.0, 75.0, None),
        (3.0, 0.0, None),
        (3000.0, 75.0, 'likely in mV: say drive_unit = "mV"'),
        (1e-5, 75.0, "V was likely called mV"),
        (3.0, 75e3, 'likely in MHz: say response_unit = "MHz"'),
        (3.0, 75e9, 'likely in Hz: say response_unit = "Hz"'),
        (3.0, 75e-9, "GHz was likely called MHz or Hz"),
        (3e-3, 75.0, "either V was called mV"),
        (250.0, 0.1, "either the drive is in mV"),
        (1e308, 75.0, "likely in mV"),
    ],
)
def test_unit_slips(drive, response, said):
    recording = scaled(drive, response)
    if said is None:
        check_plausible(recording)
        return
    with pytest.raises(DataError) as caught:
        check_plausible(recording)
    assert said in str(caught.value) and "run 'run00'" in str(caught.value)


@pytest.mark.parametrize("form", ["r", "r.nc"])
def test_units_that_are_confirmed_are_believed(tmp_path, form):
    """5 MHz/V is a laser's, or 5 GHz/V called MHz: only the person who measured knows."""
    slow = scaled(3.0, 0.015)
    with pytest.raises(DataError, match="`units_checked = true` in the manifest, or `rapi import"):
        check_plausible(slow)
    confirmed = dataclasses.replace(slow, provenance={"units_checked": "true"})
    check_plausible(confirmed)
    write_recording(confirmed, tmp_path / form)
    read = read_recording(tmp_path / form)
    assert read.runs[0].span == pytest.approx(0.015)
    for wrong in ("yes", "1"):
        with pytest.raises(DataError, match="must be true or false"):
            check_plausible(dataclasses.replace(slow, provenance={"units_checked": wrong}))
    late = dataclasses.replace(slow.runs[0].drive, start_s=1e12)
    with pytest.raises(DataError, match="start_s"):  # which no unit explains
        run = dataclasses.replace(slow.runs[0], drive=late)
        check_plausible(dataclasses.replace(confirmed, runs=(run,)))


def test_a_manifest_confirms_its_units(tmp_path):
    path = tmp_path / "r"
    write_recording(scaled(3.0, 75.0), path)
    data = path / "run00.csv"
    head, *rows = data.read_text().splitlines()
    rows = [f"{row.rpartition(',')[0]},{5e-3 * float(row.split(',')[1])}" for row in rows]
    data.write_text("\n".join([head, *rows]) + "\n")
    manifest = path / "manifest.toml"
    text = manifest.read_text()
    with pytest.raises(DataError, match="units_checked"):
        read_recording(path)
    manifest.write_text(text.replace("[[run]]", "units_checked = true\n\n[[run]]", 1))
    assert read_recording(path).provenance["units_checked"] == "true"
    manifest.write_text(text.replace("[[run]]", "unit_checked = true\n\n[[run]]", 1))
    with pytest.raises(DataError, match="is `units_checked` meant"):
        read_recording(path)
    manifest.write_text(text.replace("[[run]]", 'units_checked = "no"\n\n[[run]]', 1))
    with pytest.raises(DataError, match="units_checked"):
        read_recording(path)


def test_displacements_are_hardly_judged_but_units_must_be_known():
    check_plausible(dataclasses.replace(scaled(300, 1e6), response_unit="nm"))
    with pytest.raises(DataError, match="check the unit"):
        check_plausible(dataclasses.replace(scaled(3, 1e12), response_unit="um"))
    with pytest.raises(DataError, match="must be one of"):
        check_plausible(dataclasses.replace(scaled(3, 75), response_unit="THz"))


def test_what_cannot_be_written_is_refused_before_anything_is_touched(tmp_path, recording):
    def attempt(said: str, **change):
        for form in ("r", "r.nc"):
            with pytest.raises(DataError, match=said):
                write_recording(dataclasses.replace(recording, **change), tmp_path / form)

    run = recording.runs[0]
    for name in ("", ".", "..", "a/b", "a\\b", "a\nb", " a", "C:x", "x" * 300):
        attempt("cannot name a run", runs=(dataclasses.replace(run, name=name),))
    attempt("response_lag_s", response_lag_s=float("nan"))
    attempt("must be one of", drive_unit="kV")
    attempt("must be text", provenance={"a": "\ud800"})
    assert os.listdir(tmp_path) == []


def test_paths_that_are_no_recording(tmp_path):
    assert "no manifest.toml in this folder" in refused(tmp_path)
    assert "no such file" in refused(tmp_path / "missing\x1b]0;x\x07")
    (tmp_path / "a.csv").write_text(CSV)
    assert "neither a netCDF-4 file nor a folder" in refused(tmp_path / "a.csv")
    (tmp_path / "e.nc").write_bytes(b"")
    assert "the file is empty" in refused(tmp_path / "e.nc")
    (tmp_path / "3.nc").write_bytes(b"CDF\x01")
    assert "netCDF-3" in refused(tmp_path / "3.nc")
    (tmp_path / "manifest.toml").write_text(HEAD + RUN.replace("a.csv", "b.csv"))
    assert "b.csv: no such file" in refused(tmp_path)


@pytest.mark.fault(name="a manifest cut short", promise="refused")
@pytest.mark.parametrize("keep", [0, 1, 30, 200])
def test_a_truncated_manifest_is_refused(tmp_path, recording, keep):
    write_recording(recording, tmp_path / "r")
    path = tmp_path / "r" / "manifest.toml"
    path.write_bytes(path.read_bytes()[:keep])
    assert "manifest.toml" in refused(tmp_path / "r")


def test_every_measured_recording_reads_and_survives(tmp_path, data):
    manifests = sorted(data.glob("*/manifest.toml"))
    assert manifests
    for manifest in manifests:
        read = read_recording(manifest.parent)
        (tmp_path / manifest.parent.name).mkdir()
        for form in ("r", "r.nc"):
            write_recording(read, tmp_path / manifest.parent.name / form)
            assert same(read_recording(tmp_path / manifest.parent.name / form), read)


@pytest.mark.slow
def test_a_million_samples_take_seconds(tmp_path):
    time_s = np.arange(1_000_000) * 1e-6
    drive = 3 + np.sin(time_s * 60)
    big = Recording.of([Drive(time_s, drive)], [10 * drive])
    start = time.perf_counter()
    write_recording(big, tmp_path / "r")
    assert same(read_recording(tmp_path / "r"), big)
    assert time.perf_counter() - start < 30


@pytest.mark.fault(name="a CSV of ours cut anywhere", promise="refused")
@pytest.mark.parametrize("cut", [1, 2, 5, 9, 20, 100])
def test_a_written_file_that_was_cut_anywhere_is_refused(tmp_path, recording, cut):
    """Its manifest counts its samples, and its last line has an end."""
    write_recording(recording, tmp_path / "r")
    path = tmp_path / "r" / "run01.csv"
    path.write_bytes(path.read_bytes()[:-cut])
    assert "run01.csv" in (said := refused(tmp_path / "r"))
    assert "cut short" in said or "breaks off" in said


@pytest.mark.fault(name="a foreign CSV whose last line breaks off", promise="refused")
@pytest.mark.parametrize(
    ("end", "whole"),
    [
        ("0.4,1.0,10.5", True),
        ("0.4,1.0,1", False),
        ("0.4,1.0,105", False),
        ("0.4,1.0,", False),
        ("0.4,1.0,99.5", False),  # of 99.5e-01: no shorter than the others, but far off
    ],
)
def test_a_foreign_file_without_a_last_line_end_is_checked_for_one_that_breaks_off(
    tmp_path, end, whole
):
    rows = "0.0,1.0,10.5\n0.1,2.0,20.5\n0.2,3.0,30.5\n0.3,2.0,20.5\n"
    path = folder(tmp_path, csv="time_s,drive,response\n" + rows + end)
    if whole:
        assert read_recording(path).runs[0].drive.size == 5
    else:
        refused(path)


@pytest.mark.fault(name="many runs that name one file, or too many bytes in all", promise="refused")
def test_runs_of_one_file_are_refused_and_so_are_too_many_bytes_in_all(tmp_path, monkeypatch):
    path = folder(tmp_path, HEAD + RUN + '[[run]]\nfile = "./a.csv"\nname = "b"\n')
    assert "name one file, 'a.csv'" in refused(path)
    (tmp_path / "b.csv").write_text(CSV)
    folder(tmp_path, HEAD + RUN + '[[run]]\nfile = "b.csv"\n')
    monkeypatch.setattr("rapi_jax.io.recordings._folder.MAX_BYTES", len(CSV) + 1)
    assert f"{2 * len(CSV)} bytes, but at most {len(CSV) + 1}" in refused(path)


@pytest.mark.fault(name="a session time too large for its digits", promise="refused")
@pytest.mark.parametrize("start", ["1e12", "-2e10", "1e300"])
def test_a_session_time_that_cannot_be_told_finely_is_refused(tmp_path, start):
    said = refused(folder(tmp_path, HEAD + RUN + f"start_s = {start}\n"))
    assert "`start_s`" in said and "not in ms" in said


@pytest.mark.fault(name="a written CSV file with whole lines missing, or added", promise="refused")
@pytest.mark.parametrize("change", [-1, -100, 1])
def test_a_written_file_with_other_than_its_lines_is_refused(tmp_path, recording, change):
    write_recording(recording, tmp_path / "r")
    path = tmp_path / "r" / "run01.csv"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[:change] if change < 0 else [*lines, lines[-1]]))
    with pytest.raises(DataError, match=f"{400 + change} sample.*the manifest says 400"):
        read_recording(tmp_path / "r")
