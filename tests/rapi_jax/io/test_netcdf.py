"""The netCDF-4 form: exact round trips, readable by others, damage found."""

import dataclasses
import tempfile
from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rapi_jax._errors import DataError
from rapi_jax.io import read_recording, write_recording
from rapi_jax.io.recordings._netcdf import read_netcdf, write_netcdf
from rapi_jax.recording._drive import WAVEFORMS, Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._run import Run


def refused(path: Path, **options: str) -> str:
    """The one line with which the recording is refused."""
    with pytest.raises(DataError) as caught:
        read_recording(path, **options)
    said = str(caught.value)
    assert said.isprintable() and said.startswith(str(path)) and len(said) < 600
    return said


def test_round_trip_keeps_bits_order_and_provenance(tmp_path, recording):
    for _ in range(2):  # new, then over itself
        write_recording(recording, tmp_path / "r.nc")
        read = read_recording(tmp_path / "r.nc")
        assert read.sha256() == recording.sha256()
        assert read.provenance == recording.provenance
        assert [run.name for run in read.runs] == ["run01", "run00"]
    (tmp_path / "r.nc").rename(tmp_path / "anything")  # the content decides, not the suffix
    assert read_recording(tmp_path / "anything").sha256() == recording.sha256()


def test_masked_samples_survive_and_are_refused_unless_asked_for(tmp_path, recording):
    response = recording.runs[0].response.copy()
    response[[3, 7]] = np.nan
    runs = (dataclasses.replace(recording.runs[0], response=response),)
    masked = dataclasses.replace(recording, runs=runs)
    write_recording(masked, tmp_path / "r.nc")
    assert read_recording(tmp_path / "r.nc", nan="mask").sha256() == masked.sha256()
    said = refused(tmp_path / "r.nc")
    assert "run 'run01': `response` has 2 value(s)" in said and "at sample 3" in said


floats = st.floats(allow_nan=False, allow_infinity=False)


@settings(deadline=None, max_examples=8, suppress_health_check=list(HealthCheck))
@given(
    values=st.lists(st.tuples(floats, floats | st.just(float("nan"))), min_size=3, max_size=20),
    step=st.floats(1e-9, 1e3),
    rate=st.none() | st.floats(1e-6, 1e9),
    waveform=st.sampled_from(WAVEFORMS),
    start=floats,
    lag=st.floats(0, 1),
    provenance=st.dictionaries(st.text(max_size=9), st.text(max_size=30), max_size=3),
)
def test_round_trip_is_exact(values, step, rate, waveform, start, lag, provenance):
    drive, response = np.array(values).T
    response = np.concatenate([response, np.full(3, -0.0)])  # at least three readings
    drive = np.concatenate([drive, [1 / 3, -0.0, 5e-324]])
    clock = np.arange(drive.size) * step
    run = Run(Drive(clock, drive, rate, waveform, start), response, "a b")
    recording = Recording((run,), "um", "um", "run", lag, provenance)
    with tempfile.TemporaryDirectory() as where:
        write_netcdf(recording, Path(where) / "r.nc")
        read = read_netcdf(Path(where) / "r.nc", nan="mask")
    assert read.sha256() == recording.sha256()
    assert read.provenance == recording.provenance


def test_others_can_read_it_and_every_variable_has_a_checksum(tmp_path, recording):
    write_recording(recording, tmp_path / "r.nc")
    with xr.open_datatree(tmp_path / "r.nc", engine="h5netcdf", decode_times=False) as tree:
        assert tree.attrs["schema"] == "rapi.recording/1"
        assert (tree.attrs["response_unit"], tree.attrs["drive_unit"]) == ("GHz", "V")
        run = tree["run01"]
        assert (run.attrs["excitation_hz"], run.attrs["waveform"]) == (10.0, "sine")
        np.testing.assert_array_equal(run["response"], recording.runs[0].response)
        assert [run[k].attrs["units"] for k in ("time_s", "drive", "response")] == ["s", "V", "GHz"]
    with h5py.File(tmp_path / "r.nc") as file:
        for name in ("run00", "run01"):
            for key in ("time_s", "drive", "response"):
                assert file[name][key].fletcher32 and file[name][key].compression == "gzip"


def plain(path: Path, unit: str = "GHz", **change: object) -> None:
    """A file made by others, with h5py alone; `change` replaces columns."""
    time = np.arange(50) * 0.01
    columns = {"time_s": time, "drive": np.sin(time), "response": 10 * np.sin(time)} | change
    with h5py.File(path, "w") as file:
        head = {"schema": "rapi.recording/1", "response_unit": unit, "drive_unit": "V", "by": 3}
        file.attrs.update({key: value for key, value in head.items() if value is not None})
        for key, column in columns.items():
            if column is not None:
                file.create_dataset(f"a/{key}", data=column)
        file["a"].attrs["excitation_hz"] = np.float32(4)
        file["a"].attrs["waveform"] = np.bytes_("sine")


def test_files_made_by_others_are_read(tmp_path):
    plain(tmp_path / "r.nc", drive=np.sin(np.arange(50) * 0.01).astype("f4"))
    read = read_recording(tmp_path / "r.nc")
    assert read.provenance == {"by": "3"}
    assert (read.runs[0].drive.excitation_hz, read.runs[0].drive.waveform) == (4.0, "sine")
    assert read.runs[0].drive.value.dtype == np.float64
    plain(tmp_path / "r.nc", "MHz", response=np.arange(50, dtype="i4"))
    assert read_recording(tmp_path / "r.nc").runs[0].response[-1] == 0.049


@pytest.mark.fault(name="netCDF with wrong content", promise="refused in one line")
@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"drive": None}, "'a' has no `drive`"),
        ({"drive": np.arange(49.0)}, "50 samples, but `drive` has 49"),
        ({"drive": np.ones((50, 1))}, "of 2 dimension(s)"),
        ({"drive": 1.0}, "of 0 dimension(s)"),
        ({"drive": np.arange(50, dtype="i8")}, "but is int64"),
        ({"drive": np.arange(50, dtype="g")}, "but is float128"),
        ({"drive": np.full(50, np.nan)}, "`drive` has 50 value(s) that are not finite"),
        ({"drive": np.array([b"a"] * 50)}, "does not hold plain numbers"),
        ({"response": np.arange(50) * 1j}, "does not hold plain numbers"),
        ({"unit": "THz"}, "`response_unit` must be one of"),
        ({"unit": None}, "`response_unit` is missing"),
        ({"time_s": -np.arange(50.0)}, "goes back at sample 1"),
        ({"time_s": np.arange(0.0), "drive": np.arange(0.0), "response": []}, "at least 3 samples"),
        ({"response": np.arange(50) * 1e9}, "likely in Hz"),
    ],
)
def test_wrong_content_is_refused(tmp_path, change, said):
    plain(tmp_path / "r.nc", **change)
    assert said in refused(tmp_path / "r.nc")


def test_no_runs_or_a_foreign_file_is_refused(tmp_path):
    h5py.File(tmp_path / "r.nc", "w").close()
    assert "`schema` is missing" in refused(tmp_path / "r.nc")
    with h5py.File(tmp_path / "r.nc", "w") as file:
        file.attrs.update(schema="rapi.recording/1", response_unit="GHz", drive_unit="V")
    assert "`run`" in refused(tmp_path / "r.nc")


@pytest.mark.fault(name="netCDF cut short", promise="refused")
@pytest.mark.parametrize("part", [0.001, 0.1, 0.5, 0.9, 0.9999])
def test_a_truncated_file_is_refused(tmp_path, recording, part):
    path = tmp_path / "r.nc"
    write_recording(recording, path)
    content = path.read_bytes()
    path.write_bytes(content[: max(9, int(part * len(content)))])
    assert "cut short" in refused(path)


@pytest.mark.fault(name="a bit flipped in the data of a netCDF file", promise="a checksum error")
def test_a_flipped_bit_in_the_data_is_a_checksum_error(tmp_path, recording):
    path = tmp_path / "r.nc"
    write_recording(recording, path)
    with h5py.File(path) as file:
        chunk = file["run01/response"].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + chunk.size // 2] ^= 1
    path.write_bytes(content)
    assert "damaged or cut short (" in refused(path)


@pytest.mark.fault(name="a value edited in a netCDF file", promise="refused")
def test_an_edited_value_does_not_match_the_hash(tmp_path, recording):
    path = tmp_path / "r.nc"
    for item, key, value in [("/", "response_lag_s", 0.5), ("run01", "start_s", 9.0)]:
        write_recording(recording, path)
        with h5py.File(path, "r+") as file:
            file[item].attrs[key] = value
        assert "damaged or edited" in refused(path)


@pytest.mark.fault(
    name="bits flipped anywhere in a netCDF file", promise="the same numbers, or refused"
)
def test_flipped_bits_anywhere_never_give_other_numbers(tmp_path, recording):
    path = tmp_path / "r.nc"
    write_recording(recording, path)
    whole, content = recording.sha256(), path.read_bytes()
    random = np.random.default_rng(0)
    found = 0
    for place in random.integers(0, len(content), 30):
        damaged = bytearray(content)
        damaged[place] ^= 1 << int(random.integers(8))
        path.write_bytes(damaged)
        try:
            assert read_recording(path).sha256() == whole
        except DataError as error:
            assert str(error).isprintable()
            found += 1
    assert found > 5
