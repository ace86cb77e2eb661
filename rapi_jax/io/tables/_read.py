"""A file as a table, by what it holds and not by what it is called."""

from pathlib import Path

from rapi_jax._errors import DataError
from rapi_jax.io._safe import StrPath, open_regular, printable

from ._arrays import read_mat_table, read_npy_table, read_npz_table
from ._hdf5 import read_hdf5_table
from ._table import Table
from ._tdms import read_tdms_table
from ._text import read_text_table

_HDF5 = b"\x89HDF\r\n\x1a\n"


def read_table(path: StrPath) -> Table:
    """The columns of a file: text, `.mat`, `.npy`, `.npz`, HDF5, netCDF-4 or TDMS.

    Raises `DataError` in one line where the file is not there, damaged, hostile or of another kind.
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
        return read_hdf5_table(path)
    if start.startswith(b"\x93NUMPY"):
        return read_npy_table(path)
    if start.startswith(b"PK\x03\x04"):
        return read_npz_table(path)
    if start.startswith(b"TDSm"):
        return read_tdms_table(path)
    if start.startswith(b"MATLAB 5.0"):
        return read_mat_table(path)
    if start.startswith(b"CDF"):
        raise DataError(f"{label}: netCDF-3. Convert it with `nccopy -k nc4`.")
    return read_text_table(path)
