"""The RA-PI model as a user of Numba writes it: one loop over samples, the plays side by side.

One vector holds the parameters: `alpha, zeta, lam` (one, or one a play), `eta, a, b, d_1 .. d_K,
d_0`. Runs start by Eq. 13 from the drive's minimum, given by the caller.
"""

import numba  # pyright: ignore[reportMissingImports]
import numpy as np

# Sums over plays may be reordered, so that they use vector instructions.
FAST = {"reassoc", "contract", "nsz"}


@numba.njit(cache=True)
def unpack(values, shape, freq, u_pp):
    """Threshold, slope and intercept of the falling bound, weight: each one a play."""
    count = shape.plays
    alpha, zeta = values[0], values[1]
    eta, a, b = values[2 + shape.lams], values[3 + shape.lams], values[4 + shape.lams]
    rank = np.arange(1, count + 1) / count
    r = alpha * rank * u_pp / 2 + zeta * freq  # Eq. (11)
    lam = np.empty(count)
    lam[:] = values[2 : 2 + shape.lams]
    return r, lam, eta * r, a * np.exp(-b * r)


@numba.njit(cache=True)
def lowest(u_min, r, lam, offset):
    """Outputs at the drive's minimum (Eq. 13)."""
    return np.maximum(u_min - r, lam * u_min + offset)


def _recursion(u, r, lam, offset, p, state, out):
    for t in range(u.size):
        x, total = u[t], 0.0
        for i in range(r.size):
            value = max(x - r[i], min(lam[i] * x + offset[i], state[i]))  # Eqs. (9), (12)
            state[i] = value
            total += p[i] * value
        out[t] = total  # Eq. (14)


plain_recursion = numba.njit(cache=True)(_recursion)
recursion = numba.njit(cache=True, fastmath=FAST)(_recursion)


@numba.njit(cache=True, fastmath=FAST)
def add_polynomial(u, d, d_0, out):
    """Add the memoryless function (Eq. 15)."""
    for t in range(u.size):
        total = 0.0
        for k in range(d.size - 1, -1, -1):
            total = (total + d[k]) * u[t]
        out[t] += total + d_0


@numba.njit(cache=True)
def residuals(values, shape, runs):
    """Weighted model less data, all runs one after another (Eq. 25)."""
    count, length = runs.u.shape
    out = np.empty(count * length)
    first = 5 + shape.lams
    d, d_0 = values[first : first + shape.order], values[first + shape.order]
    for k in range(count):
        r, lam, offset, p = unpack(values, shape, runs.freq[k], runs.u_pp[k])
        here = out[k * length : (k + 1) * length]
        recursion(runs.u[k], r, lam, offset, p, lowest(runs.u_min[k], r, lam, offset), here)
        add_polynomial(runs.u[k], d, d_0, here)
        here[:] = runs.weight[k] * (here - runs.y[k])
    return out
