"""Jumps of the model that come a sample early or late.

Where a model jumps by many times the noise, one reading on the wrong side of the jump costs more
than all that distinguishes the jump from something else. No model predicts to a fraction of a
sample when a threshold is crossed, so a reading may be compared with the jump of the sample before
or after it, at a price in chi-square.
"""

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock

from ._thresholds import THRESHOLDS


def match_jump_timing(
    error: Float[np.ndarray, "periods phases"],
    jumps: list[Float[np.ndarray, " time"]],
    block: PeriodBlock,
    variance: float,
) -> tuple[Float[np.ndarray, "periods phases"], float]:
    """Errors of one run, each reading by a jump compared with the neighbouring sample's if nearer.

    `error`: model less data. `jumps`: what each effect that jumps adds to the run's row of samples.
    `variance`: noise of a reading. Also the price of all, in units of chi-square.
    """
    price = 0.0
    for jump in jumps:
        here = block.interpolate(jump)
        # Of readings, one after the other; the row has places between the samples, too.
        steps = np.diff(here.ravel())
        if not steps.any():
            continue
        before, after = np.append(0.0, -steps), np.append(steps, 0.0)
        shifts = np.stack([before.reshape(here.shape), after.reshape(here.shape)])
        shifted = error + shifts * block.use
        nearer = np.abs(shifted).argmin(axis=0)[None]
        other = np.take_along_axis(shifted, nearer, axis=0)[0]
        moved = other**2 + THRESHOLDS.jump_timing_price * variance < error**2
        error = np.where(moved, other, error)
        price += THRESHOLDS.jump_timing_price * float(moved.sum())
    return error, price
