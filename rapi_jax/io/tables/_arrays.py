"""Tables in files of NumPy, from programs that are not trusted: nothing is unpickled."""

import zipfile
from pathlib import Path

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import MAX_BYTES, cause, open_regular, printable

from ._table import Table, columns_of, table_of

DAMAGED = "It is damaged, or holds objects, which are never unpickled: save plain arrays."


def read_npy_table(path: Path) -> Table:
    """The columns of a `.npy` file: samples x columns, or named fields."""
    label = printable(path)
    with open_regular(path) as file:
        try:
            array = np.load(file, allow_pickle=False)
        except (ValueError, EOFError, OSError, MemoryError) as error:
            raise DataError(f"{label}: cannot be read ({cause(error)}). {DAMAGED}") from error
    return arrays_table(label, "NumPy array", columns_of("", array))


def read_npz_table(path: Path) -> Table:
    """The arrays of a `.npz` file, by name."""
    label = printable(path)
    pairs = []
    with open_regular(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                check_size(label, sum(entry.file_size for entry in archive.infolist()))
            file.seek(0)
            with np.load(file, allow_pickle=False) as arrays:
                for name in arrays.files:
                    if not isinstance(arrays[name], np.ndarray):
                        continue  # a file of another kind beside them
                    pairs += columns_of(name, arrays[name])
        except DataError:
            raise
        except (ValueError, EOFError, OSError, MemoryError, zipfile.BadZipFile, KeyError) as error:
            raise DataError(f"{label}: cannot be read ({cause(error)}). {DAMAGED}") from error
    return arrays_table(label, "NumPy arrays", pairs)


def check_size(label: str, declared: int) -> None:
    if declared > MAX_BYTES:
        raise DataError(
            f"{label}: declares {declared} bytes, but at most {MAX_BYTES} are read. Split it, or "
            "keep only the arrays of the recording."
        )


def arrays_table(label: str, form: str, pairs: list[tuple[str, np.ndarray]]) -> Table:
    if not pairs:
        raise DataError(
            f"{label}: no array of real numbers with one or two dimensions. Save time, drive and "
            "response as plain arrays."
        )
    return table_of(label, form, pairs)
