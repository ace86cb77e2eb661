"""Simulated scans written out as each maker's file come back as they were."""

import dataclasses
import re

import h5py
import numpy as np
import pytest
from scope_files import (
    MAKERS,
    joined,
    keysight,
    put,
    rows,
    scanned,
    tektronix_beside,
)

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording, read_recording, write_import
from rapi_jax.io.tables._read import read_tables
from rapi_jax.io.tables._units import split_unit

T, U, Y = scanned((10.0, 2, 4.5), (20.0, 2, 4.5), sample_hz=8000.0)


def options(drive="drive", response="response", **more) -> ImportOptions:
    """Columns, and a response whose volts are GHz."""
    base = {"drive_unit": "V", "response_unit": "GHz"}
    return ImportOptions(drive=drive, response=response, **{**base, **more})


def check_same(recording, t=T, u=U, y=Y, rtol=1e-8) -> None:
    """Two runs of two periods, at 10 and 20 Hz, that hold the samples that were written."""
    assert [run.drive.excitation_hz for run in recording.runs] == [10.0, 20.0]
    assert [run.drive.waveform for run in recording.runs] == ["triangle"] * 2
    assert [run.drive.periods for run in recording.runs] == [2, 2]
    step = t[1] - t[0]
    for run in recording.runs:
        first = round((run.drive.start_s) / step)
        part = slice(first, first + run.drive.size)
        np.testing.assert_allclose(run.drive.value, u[part], rtol=rtol, atol=1e-8)
        np.testing.assert_allclose(run.response, y[part], rtol=rtol, atol=1e-6)
        np.testing.assert_allclose(run.drive.step_s, step, rtol=1e-6)
    assert 0 <= sum(run.drive.size for run in recording.runs) - t.size < 0.04 * t.size


@pytest.mark.parametrize("maker", MAKERS)
def test_files_of_makers(tmp_path, maker):
    write, drive, response = MAKERS[maker]
    path = put(tmp_path / "scope.csv", write(T - 0.05, U, Y))
    known = options(drive, response, response_unit=None, response_scale=1.0)
    recording = import_recording(path, known).recording  # the file's unit of the response: V
    assert (recording.drive_unit, recording.response_unit) == ("V", "V") or "mV" in write(T, U, Y)
    scale = 1e-3 if "PicoScope" in maker else 1.0
    found = import_recording(path, options(drive, response, response_scale=scale)).recording
    assert (found.drive_unit, found.response_unit) == ("V", "GHz")
    check_same(found)


def without_readings(text: str, header: int, count: int) -> str:
    """The first `count` samples below a header of so many lines, by their times alone."""
    lines = text.split("\n")
    for k in range(header, header + count):
        lines[k] = f"{lines[k].split(',')[0]},,"
    return "\n".join(lines)


def test_times_before_the_first_reading_hide_no_names_and_no_units(tmp_path):
    """A Keysight scope that began to record later than its window."""
    whole = keysight(T, U, Y)
    path = put(tmp_path / "scope.csv", without_readings(whole, 2, 6))
    known = ImportOptions(drive="1", response="2")
    made = import_recording(path, known)
    assert "6 row(s) without readings left out before its first reading" in made.notes[0]
    assert "columns 0 'x-axis' (s), 1 (V), 2 (V)" in made.notes[0]
    (assumed,) = (note for note in made.notes if "assumed" in note)
    assert assumed.startswith("scope.csv: assumed: the response is a voltage in V, the unit of its")
    assert (made.recording.drive_unit, made.recording.response_unit) == ("V", "V")
    put(tmp_path / "later.csv", keysight(T[6:], U[6:], Y[6:]))
    same = import_recording(tmp_path / "later.csv", known).recording
    for run, other in zip(made.recording.runs, same.runs, strict=True):
        np.testing.assert_array_equal(run.response, other.response)
        np.testing.assert_allclose(run.drive.time, other.drive.time, atol=1e-12)
    put(tmp_path / "later.csv", without_readings(whole, 40, 1))  # a gap is no late beginning
    rows = (tmp_path / "later.csv").read_text().splitlines()
    with pytest.raises(DataError, match="missing or beyond the range") as refused:
        import_recording(tmp_path / "later.csv", known)
    (line,) = re.findall(r"first at sample \d+ \(line (\d+)\)", str(refused.value))
    assert rows[int(line) - 1].endswith(",") and not rows[int(line) - 2].endswith(",")


def test_a_file_a_channel(tmp_path):
    drive = put(tmp_path / "F0000CH1.CSV", tektronix_beside(T, U))
    response = put(tmp_path / "F0000CH2.CSV", tektronix_beside(T, Y))
    both = options("CH1", "1", drive_file=str(drive))
    check_same(import_recording(response, both).recording)


PLAIN = {
    "commas": ({}, ",".join),
    "semicolons": ({"separator": ";"}, ";".join),
    "semicolons and decimal commas": ({"separator": ";", "decimal": ","}, ";".join),
    "tabs": ({"separator": "\t"}, "\t".join),
    "spaces": ({"separator": "  "}, " ".join),
}


@pytest.mark.parametrize("kind", PLAIN)
@pytest.mark.parametrize("head", [True, False])
def test_plain_tables(tmp_path, kind, head):
    style, join = PLAIN[kind]
    text = (join(("time", "drive", "response")) + "\n" if head else "") + rows(T, U, Y, **style)
    named = options() if head else options("1", "2", time="0")
    check_same(import_recording(put(tmp_path / "a.txt", text), named).recording)


def test_comments_windows_ends_and_older_encodings(tmp_path):
    body = rows(1e6 * T, U, Y).replace("\n", "\r\n")
    text = "# a laser, 780 nm\r\n# time (\u00b5s), drive, response\r\n" + body
    for code in ("latin-1", "utf-8-sig", "utf-16"):
        check_same(import_recording(put(tmp_path / "a.csv", text, code), options()).recording)


def test_arrays_of_matlab_numpy_and_hdf5(tmp_path):
    from scipy.io import savemat

    savemat(tmp_path / "a.mat", {"time": T, "scan": {"drive": U, "response": Y[None, :]}})
    check_same(
        import_recording(tmp_path / "a.mat", options("scan.drive", "scan.response")).recording
    )
    np.savez(tmp_path / "a.npz", time=T, drive=U, response=Y)
    check_same(import_recording(tmp_path / "a.npz", options()).recording)
    np.save(tmp_path / "a.npy", np.stack([T, U, Y], axis=1))
    check_same(import_recording(tmp_path / "a.npy", options("1", "2", time="0")).recording)
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["scan/t"], file["scan/both"] = T, np.stack([U, Y])
        file["scan/note"] = "a note"
        file["scan/t"].attrs["units"] = "s"
    named = options("scan/both:0", "scan/both:1", time="scan/t")
    check_same(import_recording(tmp_path / "a.h5", named).recording)


def test_tdms_where_its_package_is_installed(tmp_path):
    nptdms = pytest.importorskip("nptdms")
    step = {"wf_increment": T[1], "wf_start_offset": 0.0, "unit_string": "V"}
    channels = [
        nptdms.ChannelObject("scan", name, values, properties=step)
        for name, values in (("drive", U), ("response", Y))
    ]
    with nptdms.TdmsWriter(str(tmp_path / "a.tdms")) as writer:
        writer.write_segment(channels)
    check_same(import_recording(tmp_path / "a.tdms", options()).recording)


def test_tdms_without_its_package_says_what_to_install(tmp_path, monkeypatch):
    import sys

    monkeypatch.setitem(sys.modules, "nptdms", None)
    (tmp_path / "a.tdms").write_bytes(b"TDSm" + bytes(60))
    with pytest.raises(DataError, match="a.tdms: TDMS files need the package nptdms. Install it"):
        import_recording(tmp_path / "a.tdms", options())


UNITS = [
    ("drive_unit", "mV", 1e3, "V"), ("drive_unit", "kV", 1e-3, "V"),
    ("drive_unit", "nm", 1e3, "um"),
    ("drive_unit", "m", 1e-6, "um"), ("response_unit", "MHz", 1e3, "GHz"),
    ("response_unit", "THz", 1e-3, "GHz"), ("response_unit", "Hz", 1e9, "GHz"),
    ("response_unit", "mm", 1e-3, "um"), ("response_unit", "nm", 1.0, "nm"),
    ("response_unit", "mV", 1e3, "V"), ("response_unit", "deg", 0.18 / np.pi, "mrad"),
    ("response_unit", "N", 1e-3, "mN"), ("response_unit", "A", 1e-3, "mA"),
    ("response_unit", "uT", 1e3, "mT"), ("response_unit", "C/m2", 0.01, "uC/cm2"),
]  # fmt: skip


@pytest.mark.parametrize(("field", "unit", "factor", "becomes"), UNITS)
def test_units(tmp_path, field, unit, factor, becomes):
    scale = {"drive_unit": 1.0, "response_unit": 1.0} | {field: factor}
    np.savez(
        tmp_path / "a.npz", time=T, drive=scale["drive_unit"] * U,
        response=scale["response_unit"] * Y,
    )  # fmt: skip
    found = import_recording(tmp_path / "a.npz", options(**{field: unit})).recording
    assert getattr(found, field) == becomes
    check_same(found)


@pytest.mark.parametrize(
    ("name", "split"),
    [
        ("tilt (deg)", ("tilt", "deg")),
        ("force [mN]", ("force", "mN")),
        ("P [uC/cm2]", ("P", "uC/cm2")),
        ("current in A", ("current", "A")),
        ("Ch1,V", ("Ch1", "V")),
        ("Channel_A", ("Channel_A", None)),
        ("input_N", ("input_N", None)),
    ],
)
def test_the_unit_in_a_name_and_letters_that_number_a_channel(name, split):
    assert split_unit(name) == split


def test_what_is_written_is_what_is_read(tmp_path):
    np.savez(tmp_path / "a.npz", time=T, drive=U, response=Y)
    made = import_recording(tmp_path / "a.npz", options())
    for name in ("r", "r.nc"):
        write_import(made, tmp_path / name)
        again = read_recording(tmp_path / name)
        assert again.sha256() == made.recording.sha256()
        assert again.provenance["imported_by"] == "rapi import"
        assert again.provenance["columns00"].startswith("time: time (s, assumed), drive: drive")
        assert str(tmp_path) not in "".join(again.provenance.values())
        assert again.provenance["import_command"] == (
            "rapi import a.npz --drive drive --response response --drive-unit V --response-unit GHz"
        )


def test_options_that_make_no_sense():
    with pytest.raises(ValueError, match="`sample_rate` must be positive"):
        ImportOptions(sample_rate=0.0)
    with pytest.raises(ValueError, match="at least one file"):
        import_recording([])
    assert dataclasses.replace(options(), cut=False).cut is False


def test_joined_runs_hold_every_sample_once(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=8000.0)
    np.savez(tmp_path / "a.npz", time=t, drive=u, response=y)
    drive, response = joined(import_recording(tmp_path / "a.npz", options()).recording)
    np.testing.assert_array_equal(drive, u)
    np.testing.assert_array_equal(response, y)


def test_two_channels_with_a_preamble_each_side_by_side(tmp_path):
    """DPO series: time and voltage of each channel beside its own preamble."""
    first = tektronix_beside(T, U).splitlines()
    second = tektronix_beside(T, Y).replace("Source,CH1", "Source,CH2").splitlines()
    file = put(tmp_path / "both.csv", "\n".join(map(",".join, zip(first, second, strict=True))))
    options = ImportOptions(drive="CH1", response="CH2", response_scale=4.5, response_unit="GHz")
    made = import_recording(file, options).recording
    np.testing.assert_allclose(made.runs[0].response[:5], 4.5 * Y[:5], atol=1e-6)
    np.testing.assert_allclose(made.runs[0].drive.value[:5], U[:5], atol=1e-6)


@pytest.mark.parametrize("shown", [1, 2])
def test_an_analyser_labels_each_row_and_may_show_a_measurement_once_more(tmp_path, shown):
    """Keysight's analysers: `DataName`, then rows of `DataValue`, each section below its setup."""
    rows = zip(T.tolist(), U.tolist(), Y.tolist(), strict=True)
    table = "".join(f"DataValue, {u!r}, {y!r}, {t!r}\n" for t, u, y in rows)
    above = (
        "SetupTitle, PUND\nTestParameter, Name, Points, Range\nTestParameter, Value, 100, 5\n"
        "Dimension1, 100, 100, 100\nDataName, V1, I1, V1_time\n"
    )
    path = put(tmp_path / "analyser.csv", shown * (above + table))
    (read,) = read_tables(path)
    assert [column.name for column in read.columns] == ["V1", "I1", "V1_time"]
    np.testing.assert_array_equal(read.load([0, 2]), [U, T])
