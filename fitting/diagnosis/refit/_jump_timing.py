"""Jumps that come a sample early or late.

Where a model jumps by many times the noise, one reading on the wrong side of the jump costs more
than all that tells the jump from something else. No model foresees to a fraction of a sample when
a threshold is crossed, so a reading may be compared with the jump of the sample before or after it,
at a price.
"""

import numpy as np

from fitting.diagnosis.noise._periods import PeriodBlock

_PRICE = 4.0  # chi-square of a reading that is counted early or late: two standard deviations


def match_jump_timing(
    error: np.ndarray, jumps: list[np.ndarray], block: PeriodBlock, variance: float
) -> tuple[np.ndarray, float]:
    """Errors of one run with readings beside jumps counted where they fit, and the price of it.

    `error`: model less data, "periods phases". `jumps`: what each effect that jumps adds to the
    run's row of samples. `variance`: noise of a reading. The price is in units of chi-square.
    """
    price = 0.0
    for jump in jumps:
        before, after = np.concatenate([jump[:1], jump[:-1]]), np.concatenate([jump[1:], jump[-1:]])
        if not (before - jump).any():
            continue
        here = block.of(jump)
        ways = np.stack([block.of(row) - here for row in (before, after)])
        others = error + ways * block.use
        best = np.abs(others).argmin(axis=0)[None]
        other = np.take_along_axis(others, best, axis=0)[0]
        moved = other**2 + _PRICE * variance < error**2
        error = np.where(moved, other, error)
        price += _PRICE * float(moved.sum())
    return error, price
