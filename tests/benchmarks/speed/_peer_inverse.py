"""The inverse as a user of Numba writes it: each sample of the drive by bisection.

The thresholds depend on the drive's own swing (Eq. 11), so that is found first, also by bisection.
"""

import numba  # pyright: ignore[reportMissingImports]
import numpy as np

from ._peer_model import FAST, lowest, unpack

TOLERANCE = 1e-13  # of the range looked in


@numba.njit(cache=True, fastmath=FAST)
def _response(x, r, lam, offset, p, state, d, d_0):
    total = 0.0
    for i in range(r.size):
        total += p[i] * max(x - r[i], min(lam[i] * x + offset[i], state[i]))
    memoryless = 0.0
    for k in range(d.size - 1, -1, -1):
        memoryless = (memoryless + d[k]) * x
    return total + memoryless + d_0


@numba.njit(cache=True)
def _at_minimum(x, r, lam, offset, p, d, d_0):
    return _response(x, r, lam, offset, p, lowest(x, r, lam, offset), d, d_0)


@numba.njit(cache=True)
def _minimum(y_min, low, high, tolerance, r, lam, offset, p, d, d_0):
    while high - low > tolerance:
        middle = 0.5 * (low + high)
        if _at_minimum(middle, r, lam, offset, p, d, d_0) < y_min:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@numba.njit(cache=True)
def extremes(values, shape, freq, y_min, y_max, low, high):
    """The drive's minimum and swing for a response between `y_min` and `y_max`."""
    first = 5 + shape.lams
    d, d_0 = values[first : first + shape.order], values[first + shape.order]
    tolerance = TOLERANCE * (high - low)
    least, most, u_min = 0.0, high - low, low
    while most - least > tolerance:
        swing = 0.5 * (least + most)
        r, lam, offset, p = unpack(values, shape, freq, swing)
        u_min = _minimum(y_min, low, high, tolerance, r, lam, offset, p, d, d_0)
        state = lowest(u_min, r, lam, offset)
        if _response(u_min + swing, r, lam, offset, p, state, d, d_0) < y_max:
            least = swing
        else:
            most = swing
    return u_min, 0.5 * (least + most)


@numba.njit(cache=True)
def bisection_inverse(values, shape, freq, y, low, high):
    """The drive, within `low` and `high`, whose response is `y`; that begins at its minimum."""
    first = 5 + shape.lams
    d, d_0 = values[first : first + shape.order], values[first + shape.order]
    u_min, swing = extremes(values, shape, freq, y.min(), y.max(), low, high)
    r, lam, offset, p = unpack(values, shape, freq, swing)
    state, out = lowest(u_min, r, lam, offset), np.empty(y.size)
    slack = 1e-9 * swing
    for t in range(y.size):
        below, above = u_min - slack, u_min + swing + slack
        while above - below > TOLERANCE * swing:
            middle = 0.5 * (below + above)
            if _response(middle, r, lam, offset, p, state, d, d_0) < y[t]:
                below = middle
            else:
                above = middle
        x = 0.5 * (below + above)
        for i in range(r.size):
            state[i] = max(x - r[i], min(lam[i] * x + offset[i], state[i]))
        out[t] = x
    return out
