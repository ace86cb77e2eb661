"""Tables in files of NumPy and MATLAB, from programs that are not trusted: nothing is unpickled."""

import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import MAX_BYTES, cause, open_regular, printable

from ._table import Table, columns_of, table_of

_DAMAGED = "It is damaged, or holds objects, which are never unpickled: save plain arrays."

_OPAQUE = (
    "it holds an object of MATLAB (a timeseries, a table or one of a class), which only MATLAB can "
    "read, or is damaged. Save its numbers there as plain arrays, such as `t = x.Time; "
    "y = x.Data; save('plain.mat', 't', 'y')`."
)


def read_npy_table(path: Path) -> Table:
    """The columns of a `.npy` file: samples x columns, or named fields."""
    label = printable(path)
    with open_regular(path) as file:
        try:
            array = np.load(file, allow_pickle=False)
        except (ValueError, EOFError, OSError, MemoryError) as error:
            raise DataError(f"{label}: cannot be read ({cause(error)}). {_DAMAGED}") from error
    return _table(label, "NumPy array", columns_of("", array))


def read_npz_table(path: Path) -> Table:
    """The arrays of a `.npz` file, by name."""
    label = printable(path)
    pairs = []
    with open_regular(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                _check_size(label, sum(entry.file_size for entry in archive.infolist()))
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                for name in arrays.files:
                    if not isinstance(arrays[name], np.ndarray):
                        continue  # a file of another kind beside them
                    pairs += columns_of(name, arrays[name])
        except DataError:
            raise
        except (ValueError, EOFError, OSError, MemoryError, zipfile.BadZipFile, KeyError) as error:
            raise DataError(f"{label}: cannot be read ({cause(error)}). {_DAMAGED}") from error
    return _table(label, "NumPy arrays", pairs)


def read_mat_table(path: Path) -> Table:
    """The variables of a MATLAB file before version 7.3, and the fields of its structures."""
    from scipy import io

    label = printable(path)
    pairs: list[tuple[str, np.ndarray]] = []
    with open_regular(path) as file:
        try:
            try:
                sizes = [8 * math.prod(shape) for _, shape, _ in io.whosmat(file)]
            except TypeError as error:  # an object has no shape
                raise DataError(f"{label}: {_OPAQUE}") from error
            _check_size(label, sum(sizes))
            file.seek(0)
            content = io.loadmat(file, squeeze_me=True)
        except DataError:
            raise
        except Exception as error:  # a damaged file makes the library raise almost anything
            raise DataError(f"{label}: cannot be read ({cause(error)}). {_DAMAGED}") from error
    for name, value in content.items():
        if not name.startswith("__"):
            pairs += _flatten(name, value)
    return _table(label, "MATLAB", pairs)


def _flatten(name: str, value: Any, depth: int = 0) -> list[tuple[str, np.ndarray]]:
    """An array, or the fields of a structure, by the names that MATLAB has for them."""
    array = np.asarray(value)
    if array.dtype.names and array.size == 1 and depth < 4:
        record = array.reshape(-1)[0]
        fields = ((f"{name}.{field}", record[field]) for field in array.dtype.names)
        return [pair for field, part in fields for pair in _flatten(field, part, depth + 1)]
    if array.dtype == object and array.size == 1 and depth < 4:
        return _flatten(name, array.reshape(-1)[0], depth + 1)
    return columns_of(name, array)


def _check_size(label: str, declared: int) -> None:
    if declared > MAX_BYTES:
        raise DataError(
            f"{label}: declares {declared} bytes, but at most {MAX_BYTES} are read. Split it, or "
            "keep only the arrays of the recording."
        )


def _table(label: str, form: str, pairs: list[tuple[str, np.ndarray]]) -> Table:
    if not pairs:
        raise DataError(
            f"{label}: no array of real numbers with one or two dimensions. Save time, drive and "
            "response as plain arrays."
        )
    return table_of(label, form, pairs)
