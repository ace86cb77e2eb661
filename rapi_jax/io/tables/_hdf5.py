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


def read_hdf5_table(path: Path) -> Table:
    """The data sets of numbers in an HDF5 file, by path; of two dimensions, by `path:column`."""
    label = printable(path)
    listed = _ask(path, label, [])[0]
    columns: list[Column] = []
    places: list[tuple[str, int | None]] = []
    for one in listed:
        for name, place in _spread(one):
            columns.append(Column(name, name.rpartition("/")[2], one["unit"]))
            places.append(place)
    if not columns:
        raise DataError(
            f"{label}: no data set of real numbers with one or two dimensions. Save time, drive "
            "and response as plain data sets."
        )

    def load(use: Sequence[int]) -> list[np.ndarray]:
        wanted = sorted({places[i][0] for i in use})
        said, body = _ask(path, label, wanted)
        arrays, at = {}, 0
        for one in said:
            size = int(np.prod(one["shape"]))
            values = np.frombuffer(body, dtype="<f8", count=size, offset=8 * at)
            arrays[one["path"]] = _upright(values.reshape(one["shape"]))
            at += size
        return [
            np.array(arrays[name] if k is None else arrays[name][:, k], dtype=np.float64)
            for name, k in (places[i] for i in use)
        ]

    return Table(label, "HDF5", tuple(columns), load)


def _spread(one: dict[str, Any]) -> Sequence[tuple[str, tuple[str, int | None]]]:
    path, shape = one["path"], one["shape"]
    if len(shape) == 1 or min(shape) == 1:
        return [(path, (path, None))]
    count = min(min(shape), _MOST)
    return [(f"{path}:{k}", (path, k)) for k in range(count)]


def _upright(array: np.ndarray) -> np.ndarray:
    """Samples along the first axis; one column as one dimension."""
    if array.ndim == 2 and min(array.shape) == 1:
        return array.ravel()
    return array.T if array.ndim == 2 and array.shape[0] < array.shape[1] else array


def _ask(path: Path, label: str, wanted: list[str]) -> tuple[list[dict[str, Any]], bytes]:
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
    return said["columns"], body
