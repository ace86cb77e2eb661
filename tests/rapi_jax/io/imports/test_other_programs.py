"""Files of other programs: tables below each other, a channel a file, force curves."""

import re
import struct
import sys
import types

import numpy as np
import pytest
from scope_files import put, rows, scanned

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording, read_recording, write_recording

RATES = (100.0, 200.0, 400.0)


def loops(rates=RATES, samples=200) -> str:
    """Loops as an aixACCT analyser writes them: a summary, then a table for each rate."""
    text = "DynamicHysteresisResult\n\nTable 1\nIndex [1]\tVc+ [V]\tPr+ [uC/cm2]\n"
    text += (
        "".join(f"{k + 1:.6e}\t2.5\t14.4\n" for k in range(len(rates))) + "\nDynamicHysteresis\n"
    )
    for k, rate in enumerate(rates):
        phase = np.arange(samples + 1) / samples
        u = 5.0 * (1.0 - np.abs(4.0 * np.mod(phase + 0.75, 1.0) - 2.0))
        p = 10.0 * np.tanh((u - 2.0 * np.cos(2 * np.pi * phase)) / 3.0)
        text += (
            f"Table {k + 1}\nWaveform: triangle\nArea [mm2]: 0.01\nTimestamp: 06/16/2017 11:39\n"
        )
        text += "Time [s]\tV+ [V]\tI1 [A]\tP1 [uC/cm2]\t\n"
        text += rows(phase / rate, u, 0.0 * u, p, separator="\t", end="\t") + "\n"
    return text


def aixacct(**more) -> ImportOptions:
    """The area of the electrode, 0.01 mm2 = 1e-4 cm2, makes a charge of the polarisation."""
    return ImportOptions(drive="V+", response="P1", response_scale=1e-4, response_unit="uC", **more)


def test_tables_below_each_other_become_runs(tmp_path):
    made = import_recording(put(tmp_path / "a.dat", loops()), aixacct())
    runs = made.recording.runs
    assert [run.drive.excitation_hz for run in runs] == pytest.approx(RATES)
    assert {(run.drive.waveform, run.drive.periods) for run in runs} == {("triangle", 1)}
    assert made.recording.response_unit == "uC"
    assert float(np.ptp(runs[0].response)) == pytest.approx(2e-3, rel=0.1)
    assert "3 tables below each other" in made.notes[0]
    assert any(note.startswith("a.dat, table 2: run01") for note in made.notes)
    once = [note for note in made.notes if "one period only" in note]
    assert once == [
        "a.dat, each table: one period only: its rate is read off the record's length; give --rate"
    ]


def test_tables_of_a_file_may_be_chosen(tmp_path):
    path = put(tmp_path / "a.dat", loops())
    made = import_recording(path, aixacct(tables=(3, 1)))
    rates = [run.drive.excitation_hz for run in made.recording.runs]
    assert rates == pytest.approx([RATES[0], RATES[2]])
    assert "2 tables below each other" in made.notes[0]
    assert made.recording.provenance["import_command"].endswith("--table 3 --table 1")
    with pytest.raises(DataError, match=r"a.dat: --table 4 is not there: the file holds 3 table"):
        import_recording(path, aixacct(tables=(4,)))
    with pytest.raises(ValueError, match="counts from 1"):
        aixacct(tables=(0,))


def test_times_and_rates_that_the_tester_states_are_taken(tmp_path):
    """Minutes apart, at rates that the length of a record tells to a part in a thousand."""
    text, times = loops(), iter(("11:39:00", "11:52:30", "12:01:10"))
    stamped = re.sub(
        r"Timestamp: 06/16/2017 11:39\n",
        lambda found: f"Timestamp: 06/16/2017 {next(times)}\nHysteresis Frequency [Hz]: RATE\n",
        text,
    )
    for rate in RATES:
        stamped = stamped.replace("RATE", f"{rate:g}", 1)
    made = import_recording(put(tmp_path / "a.dat", stamped), aixacct())
    runs = made.recording.runs
    assert [run.drive.start_s for run in runs] == [0.0, 810.0, 1330.0]
    assert [run.drive.excitation_hz for run in runs] == list(RATES)
    assert "their times are as the file states" in made.notes[0]
    assert "a.dat, each table: its rate is as the file states" in made.notes
    # A rate that the drive does not have, and times that go back, are not taken.
    wrong = stamped.replace(f"[Hz]: {RATES[1]:g}", "[Hz]: 7").replace("12:01:10", "11:00:00")
    made = import_recording(put(tmp_path / "b.dat", wrong), aixacct())
    assert [run.drive.excitation_hz for run in made.recording.runs] == pytest.approx(RATES)
    assert "assumed: they follow each other without a pause" in made.notes[0]
    assert made.recording.runs[2].drive.start_s > 810.0


def test_rates_that_are_stated_and_a_slip_in_a_table(tmp_path):
    text = loops()
    made = import_recording(put(tmp_path / "a.dat", text), aixacct(rates=(99.5, 201.0, 400.0)))
    assert [run.drive.excitation_hz for run in made.recording.runs] == [99.5, 201.0, 400.0]
    lines = text.split("\n")
    at = 20 + next(k for k, line in enumerate(lines) if line.startswith("Time"))
    lines[at] = "what\t1.0\t1.0\t1.0"
    with pytest.raises(DataError, match=rf"table 1: line {at + 1}: column 0 must be a number"):
        import_recording(put(tmp_path / "b.dat", "\n".join(lines)), aixacct())


def test_a_drive_file_holds_one_table(tmp_path):
    put(tmp_path / "a.dat", loops())
    options = aixacct(drive_file=str(tmp_path / "a.dat"))
    with pytest.raises(DataError, match="3 tables. Give a file that holds one"):
        import_recording(tmp_path / "a.dat", options)


def lecroy(t, y) -> str:
    """LeCroy: a file a channel, without units."""
    head = f"LECROYWS104MXs-A,54569,Waveform\nSegments,1,SegmentSize,{t.size}\n"
    head += "Segment,TrigTime,TimeSinceSegment1\n#1,06-Dec-2024 13:07:09,0                 \n"
    return head + "Time,Ampl\n" + rows(t, y)


def test_channels_of_a_lecroy_with_times_a_fraction_of_a_step_apart(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), (20.0, 3, 4.5), sample_hz=4000.0)
    put(tmp_path / "C1.csv", lecroy(t + 3e-5, y))
    put(tmp_path / "C2.csv", lecroy(t, u))
    made = import_recording(
        tmp_path / "C1.csv",
        ImportOptions(
            drive="Ampl", response="Ampl", drive_unit="V", response_unit="GHz",
            drive_file=str(tmp_path / "C2.csv"),
        ),
    )  # fmt: skip
    assert [run.drive.excitation_hz for run in made.recording.runs] == [10.0, 20.0]
    assert any("were sampled at other times" in note for note in made.notes)


class MissingMetaDataError(BaseException):
    """As afmformats has it."""


class Curve(dict):
    """A curve as afmformats has it: columns in SI units."""

    columns = property(list)


def afmformats(missing: bool) -> types.ModuleType:
    """A stand-in for the package: two cycles of a piezo, with a force that is not taken."""
    module = types.ModuleType("afmformats")
    t, u, y = scanned((1.0, 3, 4.0), sample_hz=200.0)

    def load_data(path, meta_override=None):
        if missing and not meta_override:
            raise MissingMetaDataError("spring constant")
        height = {"height (piezo)": 1e-6 * u, "height (measured)": 1e-7 * y}
        return [Curve({"force": y, "time": t, **height})]

    vars(module)["load_data"] = load_data
    return module


def errors() -> types.ModuleType:
    """Its module of errors."""
    module = types.ModuleType("afmformats.errors")
    vars(module)["MissingMetaDataError"] = MissingMetaDataError
    return module


@pytest.mark.parametrize("missing", [False, True])
def test_force_curves_by_afmformats(tmp_path, monkeypatch, missing):
    monkeypatch.setitem(sys.modules, "afmformats", afmformats(missing))
    monkeypatch.setitem(sys.modules, "afmformats.errors", errors())
    put(tmp_path / "a.ibw", "wave")
    options = ImportOptions(drive="height (piezo)", response="height (measured)")
    made = import_recording(tmp_path / "a.ibw", options)
    (run,) = made.recording.runs
    assert (made.recording.drive_unit, made.recording.response_unit) == ("um", "um")
    assert run.drive.u_pp == pytest.approx(4.0, rel=0.02)
    assert (
        "columns 0 'time' (s), 1 'height (measured)' (m), 2 'height (piezo)' (m)" in made.notes[0]
    )


def test_force_curves_without_afmformats_say_what_to_install(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "afmformats", None)
    put(tmp_path / "a.ibw", "wave")
    with pytest.raises(DataError, match=r"pip install afmformats` \(the extra `afm`\)"):
        import_recording(tmp_path / "a.ibw", ImportOptions())


def below_settings(t, u, y) -> str:
    """A ferroelectric loop: one row of settings under names of its own, then the samples."""
    head = "R,Ohm\tC,pF\tTemp,C\n0000000000\t0000100000\t+025.00\nCh1,V\tCh2,V\tTime,s\n"
    return head + rows(u, y, t, separator="\t")


def test_samples_below_a_row_of_settings(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    path = put(tmp_path / "a.txt", below_settings(t, u, y))
    made = import_recording(path, ImportOptions(drive="Ch1", response="Ch2"))
    (run,) = made.recording.runs
    assert (run.drive.size, run.drive.periods) == (t.size, 3)
    assert (made.recording.drive_unit, made.recording.response_unit) == ("V", "V")
    np.testing.assert_allclose(run.response, y, rtol=1e-8)
    assert "columns 0 'Ch1,V', 1 'Ch2,V', 2 'Time,s'" in made.notes[0]


def test_all_that_a_file_leaves_open_is_asked_at_once(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    np.savez(tmp_path / "a.npz", V1=u, D1=y)
    with pytest.raises(DataError) as caught:
        import_recording(tmp_path / "a.npz", ImportOptions())
    asked = str(caught.value)
    assert all(
        f"--{name}" in asked for name in ("response", "drive", "response-unit", "drive-unit")
    )
    assert "No column is a time. Name it by --time, or give --sample-rate." in asked
    assert asked.count("Columns, by number or name") == 1
    answers = ImportOptions(
        response="D1", drive="V1", response_unit="nm", drive_unit="V", sample_rate=2000.0
    )
    (run,) = import_recording(tmp_path / "a.npz", answers).recording.runs
    assert run.drive.excitation_hz == pytest.approx(10.0)


def test_columns_without_names_are_told_apart_by_number_and_range(tmp_path):
    """Where an empty column stands first, the number that is shown is the one to give."""
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    lines = (f",{a},{b},{c}" for a, b, c in zip(t, y, u, strict=True))
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    with pytest.raises(DataError) as caught:
        import_recording(tmp_path / "a.csv", ImportOptions())
    assert f"0 ({t.min():.4g} to {t.max():.4g}), 1 (" in str(caught.value)
    assert f", 2 ({u.min():.4g} to {u.max():.4g})." in str(caught.value)
    named = ImportOptions(time="0", response="1", drive="2", response_unit="nm", drive_unit="V")
    (run,) = import_recording(tmp_path / "a.csv", named).recording.runs
    assert run.drive.u_pp == pytest.approx(np.ptp(u))
    assert run.span == pytest.approx(np.ptp(y))


def test_a_unit_of_another_quantity_says_what_to_give(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    np.savez(tmp_path / "a.npz", time=t, drive=u, response=y)
    options = ImportOptions(drive_unit="uC", response_unit="GHz")
    with pytest.raises(DataError, match=r"not 'uC'.*a charge.*the factor to it by --drive-scale"):
        import_recording(tmp_path / "a.npz", options)


@pytest.mark.parametrize(
    ("unit", "becomes", "factor"),
    [("A", "mA", 1e3), ("deg", "mrad", np.pi / 0.18), ("T", "mT", 1e3)],
)
def test_a_drive_need_not_be_a_voltage(tmp_path, unit, becomes, factor):
    """A diode's current tunes a laser, a motor's angle a joint, a coil's field a core."""
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    np.savez(tmp_path / "a.npz", time=t, drive=u, response=y)
    options = ImportOptions(drive_unit=unit, response_unit="um")
    made = import_recording(tmp_path / "a.npz", options).recording
    assert made.drive_unit == becomes
    assert made.runs[0].drive.u_pp == pytest.approx(factor * np.ptp(u))
    write_recording(made, tmp_path / "out")
    again = read_recording(tmp_path / "out")
    assert again.drive_unit == becomes and again.sha256() == made.sha256()


def test_a_unit_of_a_response_for_the_drive_asks_whether_they_are_exchanged(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    table = "\n".join(f"{a!r},{b!r},{1e3 * c!r}" for a, b, c in np.stack([t, u, y], 1).tolist())
    (tmp_path / "a.csv").write_text(f"t (s),piezo (V),nu (MHz)\n{table}\n", encoding="utf-8")
    options = ImportOptions(drive="nu", response="piezo")
    likely = "'nu \\(MHz\\)'.*unit is MHz.*--drive piezo --response nu`"
    with pytest.raises(DataError, match=likely):
        import_recording(tmp_path / "a.csv", options)
    said = ImportOptions(drive="nu", response="piezo", drive_unit="MHz")
    with pytest.raises(DataError, match="not 'MHz'.*are --drive and --response exchanged"):
        import_recording(tmp_path / "a.csv", said)


def test_a_drive_file_without_times_is_named(tmp_path):
    t, u, y = scanned((10.0, 3, 4.5), sample_hz=2000.0)
    np.savez(tmp_path / "a.npz", time=t, D1=y)
    np.savez(tmp_path / "b.npz", V1=u)
    options = ImportOptions(
        response="D1", drive="V1", response_unit="nm", drive_unit="V",
        drive_file=str(tmp_path / "b.npz"),
    )  # fmt: skip
    with pytest.raises(DataError, match=r"no column of .*b\.npz is a time"):
        import_recording(tmp_path / "a.npz", options)


def element(kind: int, data: bytes) -> bytes:
    """One data element of a MATLAB 5 file: its type, its size, and its bytes, padded to 8."""
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matlab_object() -> bytes:
    """A file of MATLAB 5 whose one variable is a timeseries: an array of class 17, without a shape.

    As MATLAB writes it: name, type system and class, then numbers that only MATLAB understands.
    """

    def flags(kind: int) -> bytes:
        return element(6, struct.pack("<II", kind, 0))

    numbers = element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
    inner = element(
        14, flags(13) + element(5, struct.pack("<ii", 6, 1)) + element(1, b"") + numbers
    )
    words = b"".join(element(1, word) for word in (b"x", b"MCOS", b"timeseries"))
    head = b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM"
    return head + element(14, flags(17) + words + inner)


def test_an_object_of_matlab_says_how_to_save_its_numbers(tmp_path):
    (tmp_path / "a.mat").write_bytes(matlab_object())
    with pytest.raises(DataError, match=r"an object of MATLAB .* Save its numbers there as plain"):
        import_recording(tmp_path / "a.mat", ImportOptions())
