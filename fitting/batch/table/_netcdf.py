"""A table as netCDF-4: `value` and `stderr` over recordings and parameters, checksums on."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from rapi_jax.io import printable, write_atomic

from ._columns import Column, Parameter
from ._csv import harmless

SCHEMA = "rapi.results/1"
_COUNTS = {"exit_code", "tries", "scans", "scans_counted", "drives"}
_WORDS = {"recording", "status", "verdict", "set", "operator", "effects", "at_bound", "reasons"}
_WORDS |= {"task", "path", "unit", "drive_unit", "faults", "recorded_at", "started_at"}
_WORDS |= {"data_sha256", "message", "inverse", "notes", "method"}


def write_netcdf(
    columns: Sequence[Column], parameters: Sequence[Parameter], path: Path, *, csv_sha256: str
) -> None:
    """Write the table, whole or not at all. Raises `OutputError`.

    Numbers that are missing are NaN, text that is missing is empty; flags are 1, 0 or NaN. Every
    array of numbers has a checksum, and `csv_sha256` is that of `results.csv` with the same table.
    """
    import xarray as xr

    variables: dict[str, Any] = {
        _safe_name(column.name): _variable(column) for column in columns if not column.estimated
    }
    coordinates = {
        "recording": variables.pop("recording"),
        "parameter": ("parameter", _texts([one.name for one in parameters])),
        "parameter_unit": ("parameter", _texts([one.unit for one in parameters])),
    }
    count = len(columns[0].values)
    for key in ("value", "stderr"):
        stack = [getattr(one, key) for one in parameters]
        matrix = np.stack(stack, axis=1) if stack else np.empty((count, 0))
        variables[key] = (
            ("recording", "parameter"),
            matrix,
            {"units": "1", "comment": "in the unit that parameter_unit names"}
            if not _common(parameters)
            else {"units": _common(parameters)},
        )
    attributes = {"schema": SCHEMA, "results_csv_sha256": csv_sha256}
    table = xr.Dataset(variables, coordinates, attributes)
    encoding = {
        str(name): {"zlib": True, "complevel": 4, "fletcher32": True, "_FillValue": None}
        for name, one in table.variables.items()
        if one.dtype.kind in "fi" and one.size
    }
    # To memory first, so that a full disk is met by one plain write.
    write_atomic(path, table.to_netcdf(None, engine="h5netcdf", encoding=encoding))


def _variable(column: Column) -> tuple[str, np.ndarray, dict[str, str]]:
    units = {"units": column.unit} if column.unit else {}
    if column.name in _WORDS:
        return "recording", _texts(["" if v is None else str(v) for v in column.values]), units
    if column.name in _COUNTS and None not in column.values:
        return "recording", np.array(column.values, dtype=np.int64), units
    numbers = [math.nan if v is None else float(v) for v in column.values]
    return "recording", np.array(numbers, dtype=float), units


def _common(parameters: Sequence[Parameter]) -> str:
    units = {one.unit for one in parameters}
    return units.pop() if len(units) == 1 else ""


def _texts(texts: Sequence[str]) -> np.ndarray:
    out = np.empty(len(texts), dtype=object)
    out[:] = [printable(text, 2000) for text in texts]
    return out


def _safe_name(name: str) -> str:
    """A name that netCDF takes."""
    return harmless(name).replace("/", "|")
