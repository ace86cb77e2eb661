"""A table as Parquet, where pyarrow is installed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from rapi_jax import DataError
from rapi_jax.io import atomic_path, printable

from ._columns import Column


def import_pyarrow() -> Any:
    """The module. Raises `DataError` where it is missing."""
    try:
        import pyarrow
    except ImportError as error:
        raise DataError(
            "Parquet needs pyarrow, which is not installed. Install it with the extra `parquet`: "
            "`uv sync --extra parquet`; `results.csv` and `results.nc` need nothing more."
        ) from error
    return pyarrow


def write_parquet(columns: Sequence[Column], path: Path) -> None:
    """Write the columns as in `results.csv`, their units in the fields' metadata.

    Raises `DataError` where pyarrow is missing, `OutputError` where the file cannot be written.
    """
    pyarrow = import_pyarrow()
    from pyarrow import parquet

    fields, arrays = [], []
    for column in columns:
        values = [printable(v, 2000) if isinstance(v, str) else v for v in column.values]
        array = pyarrow.array(values)
        if pyarrow.types.is_null(array.type):
            array = pyarrow.array(values, type=pyarrow.string())
        unit = {"units": column.unit} if column.unit else None
        fields.append(pyarrow.field(printable(column.name), array.type, metadata=unit))
        arrays.append(array)
    table = pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields))
    with atomic_path(path) as temporary:
        parquet.write_table(table, temporary)
