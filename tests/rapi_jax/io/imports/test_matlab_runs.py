"""MATLAB files that hold several runs: structure arrays, and matrices of one shape."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat
from scope_files import scanned

from rapi_jax import DataError
from rapi_jax.io import ImportOptions, import_recording

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
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


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


def test_matrices_without_a_matrix_of_times_stay_columns(tmp_path):
    t, u, y = runs()[0]
    one, other = np.stack([t, u, y], axis=1), np.stack([t, u, -y], axis=1)
    savemat(tmp_path / "a.mat", {"one": one, "other": other})
    with pytest.raises(DataError, match="0 'one:0', 1 'one:1'"):
        import_recording(tmp_path / "a.mat", OPTIONS)
