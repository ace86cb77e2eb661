"""Tables in HDF5 and netCDF-4 files of other programs, MATLAB 7.3 among them."""

import functools
import json
import os
import subprocess  # noqa: S404
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import bytes_on_disk, open_regular, printable

from ._runs_in_matrices import find_runs
from ._table import Column, Table

_TIMEOUT = 600.0  # s; the process limits itself to far less
_MATLAB = b"MATLAB 7.3"
_MOST = 100  # columns of one data set
_DAMAGED = "Export the file again, or save its arrays as .npz."


def read_hdf5_tables(path: Path) -> list[Table]:
    """The data sets of numbers in an HDF5 file, by path; of two dimensions, by `path:column`.

    Of a structure array of MATLAB 7.3 each element is a table, with its fields as columns, and so
    is each column of matrices of one shape beside a clock in a file of MATLAB 7.3, as in an older
    file; of a file that holds several of these the first one is read.
    """
    label = printable(path)
    said, _ = _ask(path, label, [])
    matlab = _is_matlab(path)
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
    if matlab and (runs := _columns_as_runs(path, label, listed)):
        return runs
    return [_table(path, label, "MATLAB" if matlab else "HDF5", listed, matlab=matlab)]


def _is_matlab(path: Path) -> bool:
    """Whether MATLAB wrote the file, whose matrices then have their axes reversed."""
    with open_regular(path) as file:
        return file.read(len(_MATLAB)) == _MATLAB


def _columns_as_runs(path: Path, label: str, listed: dict[str, dict[str, Any]]) -> list[Table]:
    """Tables of the runs that are columns of matrices of one shape; none where there are none.

    All runs of a file are read by one process, and kept while the tables are.
    """

    @functools.cache
    def read(wanted: tuple[str, ...]) -> dict[str, np.ndarray]:
        return _load(path, label, wanted, matlab=True)

    shapes = [(name, _upright(np.empty(one["shape"], "V0")).shape) for name, one in listed.items()]
    found = find_runs(shapes, lambda name: read((name,))[name])
    if found is None:
        return []
    one_for_all = len(dict(shapes)[found.time]) == 1
    return [
        _named_columns(
            f"{label}, columns {k + 1}",
            "MATLAB",
            [
                (name, name, None if one_for_all and name == found.time else k, listed[name])
                for name in (found.time, *found.others)
            ],
            read,
        )
        for k in range(found.width)
    ]


def _table(
    path: Path, label: str, form: str, named: dict[str, dict[str, Any]], *, matlab: bool = True
) -> Table:
    """The data sets `named` as columns of a table."""
    columns = [
        (name, one["path"], column, one)
        for title, one in named.items()
        for name, column in _spread(title, one["shape"])
    ]
    read = functools.partial(_load, path, label, matlab=matlab)
    return _named_columns(label, form, columns, read)


def _named_columns(
    label: str,
    form: str,
    named: Sequence[tuple[str, str, int | None, dict[str, Any]]],
    read: Callable[[tuple[str, ...]], dict[str, np.ndarray]],
) -> Table:
    """A table of columns of data sets: name, path, number of the column, what is known of it."""

    def load(use: Sequence[int]) -> list[np.ndarray]:
        arrays = read(tuple(sorted({named[i][1] for i in use})))
        return [
            np.array(arrays[name] if k is None else arrays[name][:, k], dtype=np.float64)
            for _, name, k, _ in (named[i] for i in use)
        ]

    columns = [Column(name, name.rpartition("/")[2], one["unit"]) for name, _, _, one in named]
    return Table(label, form, tuple(columns), load)


def _load(path: Path, label: str, wanted: Sequence[str], *, matlab: bool) -> dict[str, np.ndarray]:
    """The data sets at the paths `wanted`, samples along the first axis."""
    said, body = _ask(path, label, wanted)
    arrays, at = {}, 0
    for one in said["columns"]:
        size = int(np.prod(one["shape"]))
        values = np.frombuffer(body, dtype="<f8", count=size, offset=8 * at).reshape(one["shape"])
        arrays[one["path"]] = _upright(values.T if matlab else values)
        at += size
    return arrays


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


def _ask(path: Path, label: str, wanted: Sequence[str]) -> tuple[dict[str, Any], bytes]:
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
