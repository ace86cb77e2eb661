"""Which of a file's columns a drive and a response likely are, where nobody has said."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.io.tables._table import Table

from ._clock_column import is_clock


def choose_column(
    what: str, table: Table, free: list[int], known: Mapping[str, int | None]
) -> int | None:
    """Of columns that may all be meant the one to show; `known`: places of the others, by role.

    A drive is as smooth as a command. A response that is measured in another unit than the drive,
    where there is one, is no second reading of that.
    """
    drive = known.get("drive")
    if what == "drive":
        smooth = _smooth(table, free)
        return smooth[0] if smooth else next(iter(free), None)
    if drive is not None and drive < len(table.columns):
        unit = table.columns[drive].unit
        free = [i for i in free if table.columns[i].unit not in (None, unit)] or free
    return next(iter(free), None)


def _smooth(table: Table, places: list[int]) -> list[int]:
    """Columns that change far less from sample to sample than most of them; none where damaged."""
    try:
        columns = table.load(places)
    except DataError:
        return []
    rough = np.array([_roughness(column) for column in columns])
    usual = np.median(rough[np.isfinite(rough)]) if np.isfinite(rough).any() else 0.0
    return [
        i for i, own in zip(places, rough, strict=True) if THRESHOLDS.commanded_ratio * own < usual
    ]


def _roughness(value: Float[np.ndarray, " samples"]) -> float:
    """Third differences as a share of the span; infinite of a column that is no signal."""
    span = float(np.ptp(value)) if value.size > 3 and np.isfinite(value).all() else 0.0
    if span == 0.0 or is_clock(value):
        return np.inf
    return float(np.median(np.abs(np.diff(value, 3)))) / span
