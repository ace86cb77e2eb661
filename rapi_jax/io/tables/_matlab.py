"""Tables in MATLAB files before version 7.3: arrays, structures, and structures of several runs."""

import dataclasses
import math
from pathlib import Path
from typing import Any

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import cause, open_regular, printable

from ._arrays import DAMAGED, arrays_table, check_size
from ._runs_in_matrices import find_runs, last_part
from ._table import Table, columns_of

_OPAQUE = (
    "it holds an object of MATLAB (a timeseries, a table or one of a class), which only MATLAB can "
    "read, or is damaged. Save its numbers there as plain arrays, such as `t = x.Time; "
    "y = x.Data; save('plain.mat', 't', 'y')`."
)
_DEEP = 4  # structures in each other

Pairs = list[tuple[str, np.ndarray]]


def read_mat_tables(path: Path) -> list[Table]:
    """The variables of a MATLAB file, and the fields of its structures, as columns.

    Several tables, one for each run, come from a structure array, whose elements are runs, and from
    matrices of one shape beside a time that is a matrix of that shape, too, or one clock for all:
    their columns are runs. Of a file that holds both or several of these the first ones are read.
    """
    label = printable(path)
    content = _load(path, label)
    pairs: Pairs = []
    for name, value in content.items():
        elements = _elements(value)
        if elements is None:
            pairs += _flatten(name, value)
            continue
        runs = [_flatten("", element) for element in elements]
        if not all(runs):
            empty = [k + 1 for k, run in enumerate(runs) if not run]
            fields = ", ".join(printable(field, 20) for field in elements[0].dtype.names or ())
            raise DataError(
                f"{label}: element {empty[0]} of the structure array '{printable(name, 40)}' "
                f"(fields {fields}) has no field that is an array of real numbers with one or two "
                "dimensions. Give each element its time, drive and response as such arrays."
            )
        return [
            _named(arrays_table(f"{label}, {printable(name, 40)}({k + 1})", "MATLAB", run))
            for k, run in enumerate(runs)
        ]
    runs = _columns_as_runs(content)
    if runs:
        return [
            _named(arrays_table(f"{label}, columns {k + 1}", "MATLAB", run))
            for k, run in enumerate(runs)
        ]
    return [_named(arrays_table(label, "MATLAB", pairs))]


def _load(path: Path, label: str) -> dict[str, Any]:
    from scipy import io

    with open_regular(path) as file:
        try:
            try:
                sizes = [8 * math.prod(shape) for _, shape, _ in io.whosmat(file)]
            except TypeError as error:  # an object has no shape
                raise DataError(f"{label}: {_OPAQUE}") from error
            check_size(label, sum(sizes))
            file.seek(0)
            content = io.loadmat(file, squeeze_me=True)
        except DataError:
            raise
        except Exception as error:  # a damaged file makes the library raise almost anything
            raise DataError(f"{label}: cannot be read ({cause(error)}). {DAMAGED}") from error
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _elements(value: Any) -> list[Any] | None:
    """The elements of a structure array of several, in the order in which MATLAB counts them."""
    array = np.asarray(value)
    if array.dtype.names and array.size == 1:  # a structure that holds nothing but one
        fields = [array.reshape(-1)[0][field] for field in array.dtype.names]
        inner = [found for one in fields if (found := _elements(one)) is not None]
        return inner[0] if inner and len(fields) == 1 else None
    several = array.dtype.names and array.size > 1
    return list(array.ravel(order="F")) if several else None


def _columns_as_runs(content: dict[str, Any]) -> list[Pairs]:
    """The runs that stand beside each other in matrices of one shape; none where it may be else."""
    arrays = [pair for name, value in content.items() for pair in _arrays(name, value)]
    values = dict(arrays)
    found = find_runs([(name, array.shape) for name, array in arrays], values.__getitem__)
    if found is None:
        return []
    names = found.time, *found.others
    return [
        [(name, values[name] if values[name].ndim == 1 else values[name][:, k]) for name in names]
        for k in range(found.width)
    ]


def _arrays(name: str, value: Any, depth: int = 0) -> Pairs:
    """Arrays of real numbers by the names that MATLAB has, samples along the first axis."""
    array = np.asarray(value)
    if array.dtype.names and array.size == 1 and depth < _DEEP:
        record = array.reshape(-1)[0]
        fields = array.dtype.names
        return [p for f in fields for p in _arrays(f"{name}.{f}", record[f], depth + 1)]
    if array.dtype.kind not in "fiub" or array.ndim not in (1, 2):
        return []
    upright = array.ndim == 1 or array.shape[0] >= array.shape[1]
    return [(name, array if upright else array.T)]


def _flatten(name: str, value: Any, depth: int = 0) -> Pairs:
    """An array as columns, or the fields of a structure, by the names that MATLAB has for them."""
    array = np.asarray(value)
    if array.dtype.names and array.size == 1 and depth < _DEEP:
        record = array.reshape(-1)[0]
        fields = ((f"{name}.{field}".lstrip("."), record[field]) for field in array.dtype.names)
        return [pair for field, part in fields for pair in _flatten(field, part, depth + 1)]
    if array.dtype == object and array.size == 1 and depth < _DEEP:
        return _flatten(name, array.reshape(-1)[0], depth + 1)
    return columns_of(name, array)


def _named(table: Table) -> Table:
    """The table with columns that may be called by the last part of their names alone."""
    columns = [
        dataclasses.replace(column, bare=last_part(column.bare))
        if ":" not in column.name
        else column
        for column in table.columns
    ]
    return dataclasses.replace(table, columns=tuple(columns))
