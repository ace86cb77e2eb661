"""Tables in HDF5 and netCDF-4 files of other programs, MATLAB 7.3 among them."""

import json
import os
import subprocess  # noqa: S404
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import bytes_on_disk, open_regular, printable

from ._table import Column, Table

_TIMEOUT = 600.0  # s; the process limits itself to far less
_MOST = 100  # columns of one data set
_DAMAGED = "Export the file again, or save its arrays as .npz."


def read_hdf5_tables(path: Path) -> list[Table]:
    """The data sets of numbers in an HDF5 file, by path; of two dimensions, by `path:column`.

    Of a structure array of MATLAB 7.3 each element is a table, with its fields as columns; of a
    file that holds several the first one is read.
    """
    label = printable(path)
    said, _ = _ask(path, label, [])
    listed = {one["path"]: one for one in said["columns"]}
    for array in said["structures"]:
        runs = [
            {field: listed[place] for field, place in element.items() if place in listed}
            for element in array["elements"]
        ]
        name = printable(array["path"], 40)
        if all(runs):
            return [
                _table(path, f"{label}, {name}({k + 1})", "MATLAB", fields)
                for k, fields in enumerate(runs)
            ]
        if any(runs):
            empty = next(k for k, fields in enumerate(runs) if not fields)
            raise DataError(
                f"{label}: element {empty + 1} of the structure array '{name}' has no field that "
                "is an array of real numbers with one or two dimensions. Give each element its "
                "time, drive and response as such arrays."
            )
    if not listed:
        raise DataError(
            f"{label}: no data set of real numbers with one or two dimensions. Save time, drive "
            "and response as plain data sets."
        )
    return [_table(path, label, "HDF5", listed)]


def _table(path: Path, label: str, form: str, named: dict[str, dict[str, Any]]) -> Table:
    """The data sets `named` as columns of a table."""
    columns: list[Column] = []
    places: list[tuple[str, int | None]] = []
    for title, one in named.items():
        for name, column in _spread(title, one["shape"]):
            columns.append(Column(name, name.rpartition("/")[2], one["unit"]))
            places.append((one["path"], column))

    def load(use: Sequence[int]) -> list[np.ndarray]:
        wanted = sorted({places[i][0] for i in use})
        said, body = _ask(path, label, wanted)
        arrays, at = {}, 0
        for one in said["columns"]:
            size = int(np.prod(one["shape"]))
            values = np.frombuffer(body, dtype="<f8", count=size, offset=8 * at)
            arrays[one["path"]] = _upright(values.reshape(one["shape"]))
            at += size
        return [
            np.array(arrays[name] if k is None else arrays[name][:, k], dtype=np.float64)
            for name, k in (places[i] for i in use)
        ]

    return Table(label, form, tuple(columns), load)


def _spread(name: str, shape: Sequence[int]) -> Sequence[tuple[str, int | None]]:
    """Names of a data set's columns, with their numbers where there are several."""
    if len(shape) == 1 or min(shape) == 1:
        return [(name, None)]
    return [(f"{name}:{k}", k) for k in range(min(*shape, _MOST))]


def _upright(array: np.ndarray) -> np.ndarray:
    """Samples along the first axis; one column as one dimension."""
    if array.ndim == 2 and min(array.shape) == 1:
        return array.ravel()
    return array.T if array.ndim == 2 and array.shape[0] < array.shape[1] else array


def _ask(path: Path, label: str, wanted: list[str]) -> tuple[dict[str, Any], bytes]:
    script = Path(__file__).with_name("_hdf5_columns.py")
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "HDF5_USE_FILE_LOCKING": "FALSE"}
    with open_regular(path) as file:
        command = [sys.executable, "-P", str(script), str(bytes_on_disk(file)), *wanted]
        try:
            done = subprocess.run(  # noqa: S603 (our own script; names are arguments, not a shell's)
                command, stdin=file, capture_output=True, env=environment, timeout=_TIMEOUT
            )
        except subprocess.TimeoutExpired as error:
            raise DataError(f"{label}: reading did not end. {_DAMAGED}") from error
    line, _, body = done.stdout.partition(b"\n")
    if done.returncode or not line:
        raise DataError(f"{label}: reading crashed the HDF5 library, or did not end. {_DAMAGED}")
    said = json.loads(line)
    if "refused" in said:
        raise DataError(f"{label}: {printable(said['refused'], 400)}")
    if "damaged" in said:
        reason = printable(str(said["damaged"]).split("\n")[0])
        raise DataError(f"{label}: damaged or cut short ({reason}). {_DAMAGED}")
    return said, body
