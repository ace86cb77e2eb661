"""Curves of atomic force microscopes, by the package afmformats: JPK, Igor."""

import logging
import warnings
import zipfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import MAX_BYTES, cause, open_regular, printable

from ._table import Column, Table

_UNITS = {"time": "s", "height (measured)": "m", "height (piezo)": "m"}
_FORCE = {"spring constant": 1.0, "sensitivity": 1.0}  # where a file lacks them: no force is taken


def read_afm_tables(path: Path) -> list[Table]:
    """A table for each curve; the height of the piezo and of its sensor are in m.

    Raises `DataError`, also without `afmformats`.
    """
    label = printable(path)
    try:
        import afmformats  # pyright: ignore[reportMissingImports]
        from afmformats.errors import MissingMetaDataError  # pyright: ignore[reportMissingImports]
    except ImportError as error:
        raise DataError(
            f"{label}: curves of an atomic force microscope need the package afmformats. Install "
            "it with `pip install afmformats` (the extra `afm`), or export the curve as text."
        ) from error
    logging.getLogger("afmformats").addHandler(logging.NullHandler())  # it logs what it raises
    _check_size(path, label)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of metadata that are not needed here
            try:
                curves = afmformats.load_data(path)
            except MissingMetaDataError:
                curves = afmformats.load_data(path, meta_override=_FORCE)
            tables = [
                _table(label if len(curves) == 1 else f"{label}, table {k + 1}", curve)
                for k, curve in enumerate(curves)
            ]
    except (DataError, KeyboardInterrupt, SystemExit):
        raise
    except BaseException as error:  # of a damaged file almost anything, and no `Exception` at that
        raise DataError(
            f"{label}: cannot be read as a curve of an atomic force microscope ({cause(error)}). "
            "Keep the name that its program gave it, or export the curve as text."
        ) from error
    if not tables:
        raise DataError(f"{label}: holds no curve. Export it again.")
    return tables


def _check_size(path: Path, label: str) -> None:
    with open_regular(path) as file:
        if zipfile.is_zipfile(file):
            with zipfile.ZipFile(file) as archive:
                declared = sum(entry.file_size for entry in archive.infolist())
            if declared > MAX_BYTES:
                raise DataError(
                    f"{label}: declares {declared} bytes, but at most {MAX_BYTES} are read. Export "
                    "fewer curves."
                )


def _table(label: str, curve) -> Table:
    names = [name for name in _UNITS if name in curve.columns]
    columns = tuple(Column(name, name, _UNITS[name]) for name in names)

    def load(use: Sequence[int]) -> list[np.ndarray]:
        return [np.array(curve[names[i]], dtype=np.float64) for i in use]

    return Table(label, "a curve of an atomic force microscope", columns, load)
