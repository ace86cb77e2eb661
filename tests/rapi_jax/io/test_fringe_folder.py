"""The folder of fringe records: round trips, what is assumed, and one line for what is wrong."""

import dataclasses
import os
import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rapi_jax import DataError
from rapi_jax.io import FringeWriter, OutputError, read_fringe_records, write_fringe_records
from rapi_jax.ranging import AirState, FringeRecord, FringeRecords

N = 300
HEAD = """\
schema = "rapi.fringes/1"
sample_hz = 30e6
channels = ["measurement", "interferometer", "cavity"]
volts_per_code = 1.0
interferometer_path_m = 7.34
cavity_spacing_hz = 1.5e9
excitation_hz = 10.0
waveform = "triangle"
wavelength_m = 780e-9
"""
RECORD = '[[record]]\nfile = "record00.npy"\nstart_s = 0.0\nrising_at_start = true\n'


def codes(channels=3, size=N):
    return np.random.default_rng(0).integers(-2048, 2048, (size, channels)).astype(np.int16)


def folder(where: Path, head: str = HEAD, records: str = RECORD, array=None) -> Path:
    (where / "manifest.toml").write_text(head + records, encoding="utf-8")
    np.save(where / "record00.npy", codes() if array is None else array)
    return where


def refused(path: Path) -> str:
    with pytest.raises(DataError) as caught:
        read_fringe_records(path)
    said = str(caught.value)
    assert said.isprintable(), said
    assert len(said) < 700
    return said


def some(count=2, *, dtype=np.int16, cavity=True, drive=False, air=None, **fields) -> FringeRecords:
    rng = np.random.default_rng(1)
    records = []
    for k in range(count):
        columns = rng.integers(-2000, 2000, (4, N + k)).astype(dtype)
        records.append(
            FringeRecord(
                columns[0],
                columns[1],
                columns[2] if cavity else None,
                columns[3] if drive else None,
                start_s=0.1 * k,
                rising_at_start=[True, False, None][k % 3],
                name=f"record{k:02d}",
            )
        )
    spacing = 1.5e9 if cavity else None
    return FringeRecords(tuple(records), 30e6, 10.0, 7.34, spacing, air=air, **fields)


def same(one: FringeRecords, other: FringeRecords) -> None:
    for field in dataclasses.fields(FringeRecords):
        if field.name != "records":
            assert getattr(one, field.name) == getattr(other, field.name), field.name
    for a, b in zip(one, other, strict=True):
        assert (a.start_s, a.rising_at_start, a.name) == (b.start_s, b.rising_at_start, b.name)
        for name in ("measurement", "interferometer", "cavity", "drive"):
            x, y = getattr(a, name), getattr(b, name)
            assert (x is None) == (y is None)
            if x is not None:
                assert x.dtype == y.dtype
                np.testing.assert_array_equal(x, y)


AIR = AirState(20.5, 101_000.0, 0.4, co2_ppm=420.0, humidity_stderr=0.05)


@pytest.mark.parametrize("dtype", [np.int16, np.float32])
@pytest.mark.parametrize("fields", [
    {}, {"cavity": False}, {"drive": True, "air": AIR}, {"count": 3, "waveform": "sine"},
    {"full_scale": (-2048.0, 2047.0), "volts_per_code": 4.9e-4, "notes": ("it's \"one\"\x7f",)},
])  # fmt: skip
def test_round_trip(tmp_path, dtype, fields):
    records = some(dtype=dtype, **fields)
    if "notes" in fields:
        records = records.replace(notes=('it\'s "one"\\x7f',))
    for _ in range(2):  # new, then over itself
        write_fringe_records(records, tmp_path / "r")
        same(read_fringe_records(tmp_path / "r"), records)
    same(read_fringe_records(tmp_path / "r" / "manifest.toml"), records)
    assert len(os.listdir(tmp_path / "r")) == len(records.records) + 1
    assert os.listdir(tmp_path) == ["r"]


def test_the_contract_is_read(tmp_path):
    air = "temperature_c = 20.0\npressure_pa = 101325\nrelative_humidity = 0.5\nowner = 'me'\n"
    records = read_fringe_records(folder(tmp_path, HEAD + air))
    (record,) = records
    array = codes()
    np.testing.assert_array_equal(record.measurement, array[:, 0])
    np.testing.assert_array_equal(record.cavity, array[:, 2])
    assert record.rising_at_start is True
    assert record.name == "record00"
    assert records.air == AirState(20.0, 101325.0, 0.5)
    assert records.notes == ()


def test_columns_are_views_of_the_file(tmp_path):
    (record,) = read_fringe_records(folder(tmp_path))
    assert not record.measurement.flags.owndata
    assert not record.measurement.flags.writeable
    assert record.measurement.strides == (6,)


@pytest.mark.parametrize("kind", ["fortran", "big-endian", "double", "header 2.0"])
def test_arrays_of_other_makes_are_read(tmp_path, kind):
    array = codes()
    if kind == "fortran":
        array = np.asfortranarray(array)
    elif kind == "big-endian":
        array = array.astype(">i2")
    elif kind == "double":
        array = array.astype(np.float64)
    folder(tmp_path, array=array)
    if kind == "header 2.0":
        with (tmp_path / "record00.npy").open("wb") as file:
            np.lib.format.write_array(file, array, version=(2, 0))
    records = read_fringe_records(tmp_path)
    np.testing.assert_array_equal(records.records[0].cavity, array[:, 2])
    assert len(records.notes) == (kind == "big-endian")


def test_channels_in_any_order_and_others_beside_them(tmp_path):
    named = '["power", "cavity", "interferometer", "drive", "measurement"]'
    head = HEAD.replace('["measurement", "interferometer", "cavity"]', named)
    records = read_fringe_records(folder(tmp_path, head, array=codes(5)))
    np.testing.assert_array_equal(records.records[0].measurement, codes(5)[:, 4])
    np.testing.assert_array_equal(records.records[0].drive, codes(5)[:, 3])
    assert records.notes == ("Channels that are not read: power.",)


@pytest.mark.parametrize(("lines", "note"), [
    ("temperature_c = 20.0\n", "index of air is taken as 1: pressure_pa, relative_humidity"),
    ("temperature_c = 20.0\npressure_pa = 1e5\nrelative_humidity = 45.0\n", "a percentage"),
])  # fmt: skip
def test_the_air_is_taken_or_noted(tmp_path, lines, note):
    records = read_fringe_records(folder(tmp_path, HEAD + lines))
    assert note in records.notes[0]
    assert (records.air is None) == ("a percentage" not in note)
    if records.air is not None:
        assert records.air.relative_humidity == pytest.approx(0.45)


def test_what_is_missing_and_assumed_is_noted(tmp_path):
    head = HEAD.replace("wavelength_m = 780e-9\n", "").replace("volts_per_code = 1.0\n", "")
    two = '[[record]]\nfile = "record00.npy"\n[[record]]\nfile = "b.npy"\n'
    np.save(tmp_path / "b.npy", codes())
    records = read_fringe_records(folder(tmp_path, head, two))
    assert records.wavelength_m == 780e-9
    assert records.records[1].start_s == pytest.approx(N / 30e6)
    assert records.records[1].rising_at_start is None
    said = " ".join(records.notes)
    for word in ("`wavelength_m`", "`volts_per_code`", "b: `start_s`"):
        assert word in said


def without(key):
    return "".join(line for line in HEAD.splitlines(True) if not line.startswith(key))


@pytest.mark.fault(name="a manifest of fringe records that is wrong", promise="refused in one line")
@pytest.mark.parametrize(("head", "records", "words"), [
    *((without(key), RECORD, f"`{key}` is missing: add") for key in (
        "schema", "sample_hz", "channels", "interferometer_path_m", "excitation_hz")),
    (HEAD, "", "`record` is missing: add one [[record]]"),
    (HEAD, "[[record]]\nstart_s = 0.0\n", "`record.0.file` is missing"),
    (without("cavity_spacing_hz"), RECORD, "`cavity_spacing_hz` is missing"),
    (HEAD.replace("fringes/1", "fringes/2"), RECORD, "`schema` must be"),
    (HEAD.replace("30e6", '"fast"'), RECORD, "`sample_hz`"),
    (HEAD.replace("30e6", "true"), RECORD, "`sample_hz`"),
    (HEAD.replace("30e6", "nan"), RECORD, "`sample_hz`"),
    (HEAD.replace("30e6", "-1.0"), RECORD, "`sample_hz`"),
    (HEAD.replace("30e6", "100.0"), RECORD, "cannot be read at"),
    (HEAD.replace("sample_hz", "sampl_hz"), RECORD, "is `sample_hz` meant?"),
    (HEAD.replace('"cavity"]', '"measurement"]'), RECORD, "there twice"),
    (HEAD.replace('["measurement", ', '["target", '), RECORD, "no 'measurement'"),
    (HEAD.replace('"triangle"', '"zigzag"'), RECORD, "`waveform`"),
    (HEAD + "full_scale = [5.0, -5.0]\n", RECORD, "must rise"),
    (HEAD + "full_scale = [5.0]\n", RECORD, "`full_scale`"),
    (HEAD + "relative_humidity = 300.0\ntemperature_c = 20.0\npressure_pa = 1e5\n", RECORD,
     "`relative_humidity` must be from 0 to 1"),
    (HEAD, RECORD + RECORD, "there twice"),
    (HEAD, RECORD.replace("true", '"yes"'), "`record.0.rising_at_start`"),
    (HEAD, RECORD.replace("record00", "../record00"), "plain path inside"),
    (HEAD, RECORD.replace("record00.npy", "/etc/passwd"), "plain path inside"),
    (HEAD, RECORD.replace("record00", "no"), "no such file"),
    (HEAD, RECORD.replace("record00.npy", "."), "file"),
    ("schema = [", "", "not valid TOML"),
])  # fmt: skip
def test_a_wrong_manifest_is_refused(tmp_path, head, records, words):
    assert words in refused(folder(tmp_path, head, records))


def npy(array, **options):
    import io

    file = io.BytesIO()
    np.lib.format.write_array(file, array, **options)
    return file.getvalue()


GOOD = npy(codes())


@pytest.mark.fault(name="an array of fringe records that is wrong", promise="refused in one line")
@pytest.mark.parametrize(("data", "words"), [
    (GOOD[:-1], "cut short"),
    (GOOD[:200], "cut short"),
    (GOOD + b"\0", "longer than it says"),
    (GOOD[:9], "not a .npy file"),
    (b"", "not a .npy file"),
    (b"time_s,drive\n" * 90, "not a .npy file"),
    (b"\x93NUMPY\x03\0" + GOOD[8:], "not a .npy file"),
    (b"\x93NUMPY\x01\0\xff\xff" + b"{" * 65535, "header has 65535 bytes"),
    (b"\x93NUMPY\x02\0\xff\xff\xff\xff" + b"{" * 99, "header has 4294967295 bytes"),
    (b"\x93NUMPY\x01\0\x10\0" + b"{" * 15 + b"\n", "header is damaged"),
    (GOOD.replace(b"'<i2'", b"'<q9'"), "int16 or float32"),
    (GOOD.replace(b"(300, 3)", b"(-30, 3)"), "header is damaged"),
    (npy(np.array([[None] * 3] * N), allow_pickle=True), "int16 or float32"),
    (npy(codes().astype(np.uint16)), "Subtract 32768"),
    (npy(codes().astype(np.int64)), "int16 or float32"),
    (npy(np.zeros((N, 3), [("a", "<i2")])), "int16 or float32"),
    (npy(codes().T), "Save the transpose"),
    (npy(codes(4)), "Name each column"),
    (npy(codes()[:, 0]), "Name each column"),
    (npy(codes()[:0]), "record00.npy"),
    (npy(codes()[:20]), "too few"),
])  # fmt: skip
def test_a_wrong_array_is_refused(tmp_path, data, words):
    folder(tmp_path)
    (tmp_path / "record00.npy").write_bytes(data)
    assert words in refused(tmp_path)


@pytest.mark.fault(name="NaN and Inf in fringe records", promise="refused with the place")
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_number_that_is_not_finite_is_found(tmp_path, value):
    array = codes(size=500_000).astype(np.float32)
    array[400_123, 1] = value
    said = refused(folder(tmp_path, array=array))
    assert "'interferometer' is not finite at sample 400123" in said


@pytest.mark.fault(name="links out of a folder of fringe records", promise="refused")
def test_links_out_of_the_folder_and_odd_files_are_refused(tmp_path):
    where = tmp_path / "r"
    where.mkdir()
    folder(where)
    (where / "record00.npy").rename(tmp_path / "outside.npy")
    (where / "record00.npy").symlink_to(tmp_path / "outside.npy")
    assert "link out of" in refused(where)
    (where / "record00.npy").unlink()
    os.mkfifo(where / "record00.npy")
    assert "not a regular file" in refused(where)
    assert "no manifest.toml" in refused(tmp_path / "none")


@pytest.mark.fault(
    name="generated damage to fringe records", promise="read, or refused in one line", trials=100
)
@settings(deadline=None, max_examples=100)
@given(st.integers(0, len(GOOD) - 1), st.binary(min_size=1, max_size=4))
def test_any_damage_is_read_or_refused_in_one_line(at, patch):
    with tempfile.TemporaryDirectory() as where:
        folder(Path(where))
        at = at % 140  # the header, mostly
        data = GOOD[:at] + patch + GOOD[at + len(patch) :]
        (Path(where) / "record00.npy").write_bytes(data)
        try:
            read_fringe_records(where)
        except DataError as error:
            assert str(error).isprintable()


def test_a_long_column_is_written_in_parts(tmp_path):
    array = codes(size=600_001)
    record = FringeRecord(array[:, 0], array[:, 1], array[:, 2])
    records = FringeRecords((record,), 1e6, 10.0, 7.34, 1.5e9)
    write_fringe_records(records, tmp_path / "r")
    np.testing.assert_array_equal(np.load(tmp_path / "r" / "record00.npy"), array)


def test_records_are_appended_one_by_one(tmp_path):
    records = some(3)
    with FringeWriter(tmp_path / "r") as writer:
        for k, record in enumerate(records):
            writer.append(records.replace(records=(record,)))
            assert writer.written == k + 1
            assert not (tmp_path / "r").exists()
    same(read_fringe_records(tmp_path / "r"), records)


def test_an_interrupted_stream_leaves_what_was_there(tmp_path):
    records = some()
    write_fringe_records(records, tmp_path / "r")
    with pytest.raises(KeyboardInterrupt), FringeWriter(tmp_path / "r") as writer:
        writer.append(some(1, cavity=False))
        raise KeyboardInterrupt
    same(read_fringe_records(tmp_path / "r"), records)
    assert os.listdir(tmp_path) == ["r"]


def test_an_interrupted_stream_can_be_kept(tmp_path):
    records = some(2)
    with (
        pytest.raises(KeyboardInterrupt),
        FringeWriter(tmp_path / "r", keep_partial=True) as writer,
    ):
        writer.append(records.replace(records=records.records[:1]))
        raise KeyboardInterrupt
    back = read_fringe_records(tmp_path / "r")
    assert len(back.records) == 1
    assert "Interrupted" in back.notes[0]
    with pytest.raises(KeyboardInterrupt), FringeWriter(tmp_path / "s", keep_partial=True):
        raise KeyboardInterrupt
    assert os.listdir(tmp_path) == ["r"]


@pytest.mark.parametrize(("second", "words"), [
    (some(1), "two records called 'record00'"),
    (some(2, cavity=False).replace(cavity_spacing_hz=1.5e9), "two folders"),
    (some(2, waveform="sine"), "`waveform`"),
    (some(2, air=AIR), "`air`"),
])  # fmt: skip
def test_records_of_two_set_ups_are_refused(tmp_path, second, words):
    if words != "two records called 'record00'":
        second = second.replace(records=second.records[1:])
    with pytest.raises(DataError, match=words), FringeWriter(tmp_path / "r") as writer:
        writer.append(some(1))
        writer.append(second)
    assert os.listdir(tmp_path) == []


def test_what_cannot_be_written_is_said(tmp_path):
    with pytest.raises(DataError, match="No fringe record"), FringeWriter(tmp_path / "r"):
        pass
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError, match="not a folder"):
        write_fringe_records(some(), tmp_path / "file")
    with pytest.raises(OutputError, match="Make the folder first"):
        write_fringe_records(some(), tmp_path / "no" / "r")
    assert (tmp_path / "file").read_text() == "mine"
    bad = some(1, dtype=np.float32)
    bad.records[0].measurement[7] = np.nan
    with pytest.raises(DataError, match="not finite"):
        write_fringe_records(bad, tmp_path / "r")
    assert os.listdir(tmp_path) == ["file"]


def test_foreign_files_in_the_folder_stay(tmp_path):
    write_fringe_records(some(2), tmp_path / "r")
    (tmp_path / "r" / "LICENSE").write_text("mine")
    write_fringe_records(some(1), tmp_path / "r")
    assert sorted(os.listdir(tmp_path / "r"))[:2] == ["LICENSE", "manifest.toml"]
    assert len(os.listdir(tmp_path / "r")) == 3
    same(read_fringe_records(tmp_path / "r"), some(1))
