"""Columns that count or tell the time, whatever they are called."""

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax.io.tables._table import Table

_LOOKED_AT = 24  # columns; of more, those behind are no clock of a file without names


def is_clock(value: Float[np.ndarray, " samples"]) -> bool:
    """Whether a column rises at every sample, and nowhere lies a step off its straight line.

    >>> import numpy as np
    >>> from rapi_jax.io.imports.columns._clock_column import is_clock
    >>> is_clock(np.round(np.arange(100) / 3000, 5)), is_clock(np.arange(100) ** 1.1)
    (True, False)
    """
    if value.size < 3 or not np.isfinite(value).all() or not (np.diff(value) > 0).all():
        return False
    line = np.linspace(value[0], value[-1], value.size)
    return bool(np.abs(value - line).max() < (line[1] - line[0]))


def find_clock_columns(table: Table, skip: int | None = None) -> list[int]:
    """The columns of a table that are clocks by their values, but `skip`; none where damaged."""
    places = [i for i in range(len(table.columns[:_LOOKED_AT])) if i != skip]
    try:
        columns = table.load(places)
    except DataError:
        return []
    return [i for i, column in zip(places, columns, strict=True) if is_clock(column)]
