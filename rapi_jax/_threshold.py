"""`threshold`: a number that decides, with its unit and where it comes from."""

import dataclasses
from typing import Any


def threshold(value: float | int | tuple[float, ...], *, unit: str, origin: str) -> Any:
    """A field of a room's frozen dataclass of thresholds.

    **Arguments:**

    - `value`: the number used, or several that are used one after the other.
    - `unit`: `"1"` for a ratio or a count, or what it is a multiple or a share of.
    - `origin`: a derivation, a calibration, a source, or a trial, and what the number trades.

    `tests/benchmarks/thresholds.py` finds every field made so, halves and doubles it.
    """
    return dataclasses.field(default=value, metadata={"unit": unit, "origin": origin})
