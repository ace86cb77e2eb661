"""Readings that are updated more seldom than they are written down."""

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Run

from ._levels import find_resolution


def find_hold(reading: Float[np.ndarray, " samples"]) -> int:
    """How many samples each value of a reading is held for; 0 where it is not held throughout.

    A reading that rests keeps its value over several updates. A slow one that is digitised changes
    by one step at a time, and not in even intervals.
    """
    limits = THRESHOLDS
    changed = np.flatnonzero(np.diff(reading) != 0.0)
    before = changed[np.diff(changed, prepend=-2) > 1]  # over two samples where it was resampled
    interval = np.diff(before)
    if interval.size < limits.held_updates:
        return 0
    usual = float(np.median(interval))
    updates = np.maximum(np.rint(interval / usual), 1.0)
    even = np.abs(interval - updates * usual) <= limits.held_jitter * usual
    step = float(np.median(np.abs(np.diff(reading[before]))))
    if even.mean() < limits.held_share or step < limits.held_steps * find_resolution(reading):
        return 0
    return round(usual)


def held_fault(run: Run, hold: int) -> Fault:
    """What to say of a run whose reading is held for `hold` samples each."""
    text = (
        f"run {run.name!r}: the reading is updated only every {hold} samples and held between, "
        "while the drive moves on: a sensor slower than the record. Average so many samples: "
        f"import the record again with `--decimate {hold}`."
    )
    return Fault("held reading", run.name, text, ((0, run.drive.size - 1),))
