"""The rate that was stated for a drive, against the one that its cycles have."""

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.imports._thresholds import THRESHOLDS


def stated_rate(found: float, options: ImportOptions, label: str) -> float:
    """The rate that was said, where the drive has it."""
    if not options.rates:
        return found
    near = min(options.rates, key=lambda rate: abs(np.log(rate / found)))
    if abs(near - found) <= THRESHOLDS.stated_rate * found:
        return near
    said = ", ".join(f"{rate:g}" for rate in options.rates)
    factor = near / found
    thousand = abs(abs(np.log10(factor)) - 3.0) < 0.02
    why = (
        "That is a factor of 1000: check --time-unit"
        if thousand
        else "Correct --rate (of several one each: --rate 5 --rate 15), or leave it out"
    )
    raise DataError(
        f"{label}: the drive repeats at {found:.5g} Hz, not at {said} Hz as said. {why}."
    )
