"""A file as a table, by what it holds and not by what it is called."""

import zipfile
from collections.abc import Sequence
from pathlib import Path

from rapi_jax._errors import DataError
from rapi_jax.io._safe import StrPath, cause, open_regular, printable

from ._afm import read_afm_tables
from ._arrays import read_npy_table, read_npz_table
from ._hdf5 import read_hdf5_tables
from ._matlab import read_mat_tables
from ._table import Table
from ._tdms import read_tdms_table
from ._text import read_text_tables

_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_table(path: StrPath) -> Table:
    """The one table of a file. Raises `DataError` where it holds several."""
    tables = read_tables(path)
    if len(tables) > 1:
        raise DataError(f"{printable(path)}: {len(tables)} tables. Give a file that holds one.")
    return tables[0]


def read_tables(path: StrPath) -> list[Table]:
    """The tables of a file: text, `.mat`, `.npy`, `.npz`, HDF5, netCDF-4, TDMS, JPK, Igor.

    Text, MATLAB files (also of version 7.3) and files of force curves may hold several, the others
    one. Raises `DataError` in one line where the file is not there, damaged, hostile or of another
    kind.
    """
    path = Path(path)
    label = printable(path)
    if path.is_dir():
        raise DataError(
            f"{label}: a folder, and no file. Give the files in it, such as {label}/*.csv."
        )
    with open_regular(path) as file:
        start = file.read(1024)
    if not start:
        raise DataError(f"{label}: the file is empty. Record or export it again.")
    if start.startswith(_HDF5) or start[512:520] == _HDF5:  # MATLAB 7.3 puts 512 bytes before
        return read_hdf5_tables(path)
    if start.startswith(b"\x93NUMPY"):
        return [read_npy_table(path)]
    if start.startswith(b"PK\x03\x04"):
        return _read_archive(path, label)
    if start.startswith(b"TDSm"):
        return [read_tdms_table(path)]
    if start.startswith(b"MATLAB 5.0"):
        return read_mat_tables(path)
    if start.startswith(b"CDF"):
        raise DataError(f"{label}: netCDF-3. Convert it with `nccopy -k nc4`.")
    if path.suffix.lower() == ".ibw":
        return read_afm_tables(path)
    return read_text_tables(path)


def choose_tables(tables: list[Table], numbers: Sequence[int], label: str) -> list[Table]:
    """Those of the `tables` of a file whose `numbers` are given, from 1; all where none is.

    Raises `DataError` for a number that the file does not have.
    """
    for number in numbers:
        if not 1 <= number <= len(tables):
            raise DataError(
                f"{label}: --table {number} is not there: the file holds {len(tables)} table(s), "
                "counted from 1."
            )
    return [tables[number - 1] for number in sorted(set(numbers))] if numbers else tables


def _read_archive(path: Path, label: str) -> list[Table]:
    """A ZIP archive: arrays of NumPy, or curves of an atomic force microscope."""
    with open_regular(path) as file:
        try:
            with zipfile.ZipFile(file) as archive:
                names = archive.namelist()
        except (zipfile.BadZipFile, OSError, ValueError) as error:
            raise DataError(
                f"{label}: a damaged ZIP archive ({cause(error)}). Copy or export it again."
            ) from error
    if any(name.endswith("header.properties") for name in names):
        return read_afm_tables(path)
    if any(name.endswith(".npy") for name in names):
        return [read_npz_table(path)]
    if any(name.startswith("xl/") for name in names):
        raise DataError(f"{label}: an Excel workbook. Save the sheet with the samples as CSV.")
    shown = ", ".join(printable(name, 40) for name in names[:3]) or "nothing"
    raise DataError(
        f"{label}: a ZIP archive without arrays of NumPy (it holds {shown}). Unpack it, and give "
        "the file that holds the samples."
    )
