"""Raw records: written whole, read back exactly, refused where anything is wrong with them."""

import hashlib
import io
import json

import numpy as np
import pytest
from benches import bench_file
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from hardware import (
    Acquisition,
    Input,
    ReplayDigitizer,
    Samples,
    dry_run,
    read_bench,
    read_samples,
    write_samples,
)
from rapi_jax import DataError, triangle

ASKED = Acquisition({"cavity": Input(1, 0.0, 1.0)}, 0.0, 1e-5, sample_hz=1e6)


def record(codes=None, **changes):
    column = np.arange(20, dtype=np.int16) if codes is None else codes
    values = {
        "codes": {"interferometer": column, "cavity": column[::-1]},
        "volts_per_code": {"interferometer": 1e-4, "cavity": 2e-4},
        "zero_v": {"interferometer": 0.1, "cavity": -0.1},
        "sample_hz": 1e6,
        "start_s": -1e-6,
        "full_scale": (-2048.0, 2047.0),
    }
    return Samples(**(values | changes))


@given(
    codes=hnp.arrays(np.int16, st.integers(2, 300)),
    scale=st.floats(1e-9, 1e3),
    start_s=st.floats(-1.0, 1.0),
    full_scale=st.none() | st.just((-32768.0, 32752.0)),
)
def test_what_is_written_is_read(tmp_path_factory, codes, scale, start_s, full_scale):
    folder = tmp_path_factory.mktemp("raw")
    scales = {"interferometer": scale, "cavity": -scale}
    one = record(codes, volts_per_code=scales, start_s=start_s, full_scale=full_scale)
    back, notes = read_samples(write_samples(one, folder, "run00", notes={"said": "so"}))
    for name in ("interferometer", "cavity"):
        np.testing.assert_array_equal(back.codes[name], one.codes[name])
        np.testing.assert_array_equal(back.volts(name), one.volts(name))
    assert (back.sample_hz, back.start_s, back.full_scale) == (1e6, start_s, full_scale)
    assert notes == {"said": "so"}


def spoil_column(path, head):
    column = path.parent / head["inputs"]["cavity"]["file"]
    data = bytearray(column.read_bytes())
    data[-1] ^= 1
    column.write_bytes(data)


def spoil_missing(path, head):
    (path.parent / head["inputs"]["cavity"]["file"]).unlink()


def outside(path, head):
    head["inputs"]["cavity"]["file"] = "../elsewhere.npy"
    path.write_text(json.dumps(head))


def without(key):
    def spoil(path, head):
        del head[key]
        path.write_text(json.dumps(head))

    return spoil


def with_(key, value):
    def spoil(path, head):
        head[key] = value
        path.write_text(json.dumps(head))

    return spoil


def cut(path, head):
    path.write_bytes(path.read_bytes()[:100])


@pytest.mark.fault(
    name="raw records cut, exchanged or of other lengths", promise="refused in one line"
)
@pytest.mark.parametrize(
    "spoil, says",
    [
        (spoil_column, "not what was written"),
        (spoil_missing, "cavity"),
        (outside, "plain path inside"),
        (without("sample_hz"), "sample_hz"),
        (with_("sample_hz", 0.0), "sample_hz"),
        (with_("start_s", "soon"), "start_s"),
        (with_("schema", "rapi.samples/9"), "schema"),
        (with_("inputs", {}), "inputs"),
        (with_("more", 1), "more"),
        (cut, "no raw record"),
    ],
)
def test_a_record_that_is_not_whole_is_refused(tmp_path, spoil, says):
    path = write_samples(record(), tmp_path, "run00")
    spoil(path, json.loads(path.read_text()))
    with pytest.raises(DataError, match=says) as caught:
        read_samples(path)
    assert "run00" in str(caught.value) or "elsewhere" in str(caught.value)


@pytest.mark.fault(name="a raw record with objects in it", promise="refused, no code run")
def test_an_object_array_is_not_unpickled(tmp_path):
    import hashlib

    path = write_samples(record(), tmp_path, "run00")
    head = json.loads(path.read_text())
    column = tmp_path / head["inputs"]["cavity"]["file"]
    np.save(column, np.array([{"a": 1}], dtype=object), allow_pickle=True)
    head["inputs"]["cavity"]["sha256"] = hashlib.sha256(column.read_bytes()).hexdigest()
    path.write_text(json.dumps(head))
    with pytest.raises(DataError, match="no column of numbers"):
        read_samples(path)


@pytest.mark.slow
def test_what_was_recorded_is_read_again_to_the_same_frequencies(tmp_path):
    drives = triangle([40.0, 80.0], amplitude=2.0, bias=3.0, samples=2000)
    raw = tmp_path / "raw"
    raw.mkdir()
    with dry_run(read_bench(bench_file(tmp_path))).bench as bench:
        first = bench.measure(drives, raw=raw)
    assert sorted(p.name for p in raw.glob("*.json")) == ["run00.json", "run01.json"]
    change = {'resource = "DIG"': f'kind = "replay"\nfolder = "{raw.as_posix()}"'}
    again = dry_run(read_bench(bench_file(tmp_path, change=change)))
    with again.bench as bench:
        second = bench.measure(drives)
        assert bench.provenance()["digitizer"].startswith("replay of ")
        with pytest.raises(DataError, match="no further raw record"):
            bench.measure(drives[0])
    for one, other in zip(first.runs, second.runs, strict=True):
        np.testing.assert_array_equal(one.response, other.response)
    assert "digitizer" not in again.sent()


@pytest.mark.fault(name="a replay asked for what it does not hold", promise="refused")
def test_a_replay_refuses_what_it_does_not_hold(tmp_path):
    with pytest.raises(DataError, match="no raw record"):
        ReplayDigitizer(tmp_path)
    write_samples(record(), tmp_path, "run00")
    with ReplayDigitizer(tmp_path) as replay:
        with pytest.raises(ValueError, match="configure"):
            replay.fetch(1.0)
        replay.configure(ASKED)
        replay.arm()
        assert replay.fetch(1.0).codes["cavity"].size == 20
        assert replay.snapshot()["record"] == "run00.json"
    for asked, says in (
        (Acquisition({"cavity": Input(1, 0.0, 1.0)}, 0.0, 1e-3, sample_hz=1e6), "too short"),
        (Acquisition({"cavity": Input(1, 0.0, 1.0)}, 0.0, 1e-5, sample_hz=5e6), "a second"),
        (Acquisition({"monitor": Input(1, 0.0, 1.0)}, 0.0, 1e-5, sample_hz=1e6), "monitor"),
    ):
        with ReplayDigitizer(tmp_path) as replay, pytest.raises(DataError, match=says):
            replay.configure(asked)
            replay.arm()
            replay.fetch(1.0).check(asked)


def npy(column, **header):
    """A column as NumPy writes it, with another `header` in the place of its own."""
    file = io.BytesIO()
    np.save(file, column)
    text = file.getvalue()
    for key, (old, new) in header.items():
        assert f"'{key}': {old}".encode() in text
        text = text.replace(f"'{key}': {old}".encode(), f"'{key}': {new}".encode())
    return text


@pytest.mark.fault(name="a raw column that claims another size or kind", promise="refused")
@pytest.mark.parametrize(
    ("data", "words"),
    [
        (npy(np.arange(20.0)), "one column of 16-bit codes"),
        (npy(np.zeros((20, 1), np.int16)), "one column of 16-bit codes"),
        (npy(np.arange(20, dtype=np.int16))[:-2], "one column of 16-bit codes"),
        (npy(np.arange(20, dtype=np.int16)) + b"more", "one column of 16-bit codes"),
        (npy(np.arange(20, dtype=np.int16), shape=("(20,)", "(10**9,)")), "no column of numbers"),
        (npy(np.arange(20, dtype=np.int16), shape=("(20,), ", f"({10**13},)")), "16-bit codes"),
        (npy(np.arange(20, dtype=np.int16), descr=("'<i2'", "'|O8'")), "no column of numbers"),
        (npy(np.arange(21, dtype=np.int16)), "differ in length"),
        (b"\x93NUMPY", "no column of numbers"),
        (b"", "no column of numbers"),
    ],
)
def test_a_column_that_is_none_is_refused_though_its_hash_is_right(tmp_path, data, words):
    path = write_samples(record(), tmp_path, "run00")
    head = json.loads(path.read_text())
    (tmp_path / head["inputs"]["cavity"]["file"]).write_bytes(data)
    head["inputs"]["cavity"]["sha256"] = hashlib.sha256(data).hexdigest()
    path.write_text(json.dumps(head))
    with pytest.raises(DataError, match=words) as caught:
        read_samples(path)
    assert "run00" in str(caught.value) and str(caught.value).isprintable()
