"""MATLAB files that hold several runs: structure arrays, and matrices of one shape."""

import dataclasses

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scope_files import scanned

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording
from rapi_jax.io.tables._read import read_tables

OPTIONS = ImportOptions(drive="u", response="freq", drive_unit="V", response_unit="GHz")
RATES = (5.0, 10.0, 40.0)


def runs():
    """Time, drive and response of a run at each rate, of as many samples each."""
    return [scanned((rate, 3, 4.5), sample_hz=400.0 * rate, noise=0.0) for rate in RATES]


def check(made) -> None:
    assert [run.drive.excitation_hz for run in made.recording.runs] == list(RATES)
    for run, (_, u, y) in zip(made.recording.runs, runs(), strict=True):
        np.testing.assert_array_equal(run.drive.value, u)
        np.testing.assert_array_equal(run.response, y)
    assert "3 tables" in made.notes[0] and "below each other" not in made.notes[0]


@pytest.mark.parametrize("nested", [False, True])
def test_the_elements_of_a_structure_array_are_runs(tmp_path, nested):
    fields = ("t", "u", "freq")
    array = np.empty((1, len(RATES)), dtype=[*((name, object) for name in fields), ("rate", "O")])
    for k, columns in enumerate(runs()):
        for name, column in zip(fields, columns, strict=True):
            array[0, k][name] = column[:, None]
        array[0, k]["rate"] = RATES[k]
    savemat(tmp_path / "a.mat", {"lab": {"scan": array}} if nested else {"scan": array})
    check(import_recording(tmp_path / "a.mat", OPTIONS))


def mark_matlab_73(path):
    """The first 512 bytes that MATLAB puts before an HDF5 file."""
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_matlab_73(path, elements, group="scan"):
    """A structure array as MATLAB writes it with `save -v7.3`: references into `#refs#`."""
    with h5py.File(path, "w", userblock_size=512) as file:
        values, structure = file.create_group("#refs#"), file.create_group(group)
        for field in elements[0]:
            places = []
            for k, element in enumerate(elements):
                target = values.create_dataset(f"{field}{k}", data=element[field])
                places.append(target.ref)
            refers = np.array(places, dtype=h5py.ref_dtype)[:, None]
            structure.create_dataset(field, data=refers, dtype=h5py.ref_dtype)
    mark_matlab_73(path)


def save_73(path, variables):
    """Variables as `save -v7.3` writes them, structures as groups; axes are reversed there."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            file.create_dataset(name, data=np.atleast_2d(value).T)
    mark_matlab_73(path)


def save(path, variables, *, version):
    """The same variables (samples x runs) as one or the other version writes them."""
    if version == "7.3":
        save_73(path, variables)
    else:
        savemat(path, variables)


@pytest.mark.parametrize("group", ["scan", "lab/scan"])
def test_so_are_those_of_version_73(tmp_path, group):
    names = ("t", "u", "freq")
    elements = [
        {n: c[None] for n, c in zip(names, columns, strict=True)} | {"rate": [[RATES[k]]]}
        for k, columns in enumerate(runs())
    ]
    write_matlab_73(tmp_path / "a.mat", elements, group)
    check(import_recording(tmp_path / "a.mat", OPTIONS))


def test_an_element_of_version_73_without_arrays_is_named(tmp_path):
    good = {"t": np.arange(9.0)[None], "u": np.arange(9.0)[None]}
    text = {"t": np.zeros((1, 0)), "u": np.zeros((1, 0))}
    write_matlab_73(tmp_path / "a.mat", [good, text])
    with pytest.raises(DataError, match="element 2 of the structure array 'scan' has no field"):
        import_recording(tmp_path / "a.mat", OPTIONS)


def test_a_reference_that_leads_nowhere_is_no_crash(tmp_path):
    write_matlab_73(tmp_path / "a.mat", [{"t": np.arange(9.0)[None]}] * 2)
    with h5py.File(tmp_path / "a.mat", "r+") as file:
        del file["#refs#/t1"]
    with pytest.raises(DataError, match="element 2 of the structure array 'scan' has no field"):
        import_recording(tmp_path / "a.mat", OPTIONS)


def test_an_element_without_arrays_is_named_with_the_fields(tmp_path):
    array = np.empty((1, 2), dtype=[("t", object), ("u", object)])
    array[0, 0]["t"] = array[0, 0]["u"] = np.arange(9.0)
    array[0, 1]["t"] = array[0, 1]["u"] = "none"
    savemat(tmp_path / "a.mat", {"scan": array})
    with pytest.raises(DataError, match=r"element 2 of the structure array 'scan' \(fields t, u\)"):
        import_recording(tmp_path / "a.mat", OPTIONS)


def test_columns_of_matrices_beside_a_matrix_of_times_are_runs(tmp_path):
    t, u, y = (np.stack(columns, axis=1) for columns in zip(*runs(), strict=True))
    savemat(tmp_path / "a.mat", {"scan": {"t": t, "u": u, "freq": y, "rate": np.array(RATES)}})
    check(import_recording(tmp_path / "a.mat", OPTIONS))


def at_one_clock():
    """Drives and responses of three runs at one clock, columns of two matrices."""
    each = [scanned((10.0, 3, swing), sample_hz=4000.0, noise=0.0) for swing in (4.5, 3.0, 1.5)]
    t, u, y = (np.stack(columns, axis=1) for columns in zip(*each, strict=True))
    return t[:, 0], u, y


def imported(folder, variables, version, **more):
    save(folder / f"{version}.mat", variables, version=version)
    options = dataclasses.replace(OPTIONS, **more)
    return import_recording(folder / f"{version}.mat", options)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matrices_at_one_clock_are_runs_in_both_versions(tmp_path, version, turned):
    """A run a column, or a run a row, with the clock as column or row."""
    t, u, y = at_one_clock()
    matrices = {"t": t[None], "u": u.T, "freq": y.T} if turned else {"t": t, "u": u, "freq": y}
    made = imported(tmp_path, matrices, version)
    assert len(made.recording.runs) == 3 and "3 tables" in made.notes[0]
    for k, run in enumerate(made.recording.runs):
        np.testing.assert_array_equal(run.drive.value, u[:, k])
        np.testing.assert_array_equal(run.response, y[:, k])
        assert run.drive.excitation_hz == 10.0


@pytest.mark.parametrize("group", ["", "lab/scan/"])
def test_matrices_of_times_are_runs_in_version_73(tmp_path, group):
    t, u, y = (np.stack(columns, axis=1) for columns in zip(*runs(), strict=True))
    save_73(tmp_path / "a.mat", {f"{group}t": t, f"{group}u": u, f"{group}freq": y})
    check(import_recording(tmp_path / "a.mat", OPTIONS))


def test_of_a_square_matrix_of_version_73_the_columns_are_those_of_matlab(tmp_path):
    """As many samples as columns: which axis is longer does not tell, but who wrote it does."""
    square = np.arange(9.0).reshape(3, 3)
    save_73(tmp_path / "a.mat", {"m": square})
    (table,) = read_tables(tmp_path / "a.mat")
    np.testing.assert_array_equal(table.load([0])[0], square[:, 0])


def test_other_hdf5_files_keep_their_columns(tmp_path):
    """Matrices beside a clock that MATLAB has not written may hold anything."""
    t, u, y = at_one_clock()
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, value in {"t": t, "u": u, "freq": y}.items():
            file[name] = value
    (table,) = read_tables(tmp_path / "a.h5")
    assert [column.name for column in table.columns][-1] == "u:2"


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matrices_without_a_matrix_of_times_stay_columns(tmp_path, version):
    t, u, y = runs()[0]
    one, other = np.stack([t, u, y], axis=1), np.stack([t, u, -y], axis=1)
    save(tmp_path / "a.mat", {"one": one, "other": other}, version=version)
    with pytest.raises(DataError, match="0 'one:0', 1 'one:1'"):
        import_recording(tmp_path / "a.mat", OPTIONS)
