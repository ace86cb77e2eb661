"""The Jacobian of the peer's residuals, in closed form, by contact.

A play's output equals the bound that it touched last, at the drive of that moment. So its
derivative with respect to `r`, `lam` and `eta` changes at contacts alone, and is kept beside the
output through the loop.
"""

import numba  # pyright: ignore[reportMissingImports]
import numpy as np

from ._peer_model import FAST, unpack


@numba.njit(cache=True, fastmath=FAST)
def _fill(u, r, lam, eta, p, b, u_min, share, freq, weight, shared, out):
    """`share`: by how much each threshold grows with `alpha`. `out`: "time parameters"."""
    plays, lams = r.size, 1 if shared else r.size
    below = u_min - r > lam * u_min + eta * r
    state = np.where(below, u_min - r, lam * u_min + eta * r)
    by_r = np.where(below, -1.0, eta)
    by_lam = np.where(below, 0.0, u_min)
    by_eta = np.where(below, 0.0, r)
    decay = np.exp(-b * r)
    order = out.shape[1] - 6 - lams
    for t in range(u.size):
        x = u[t]
        alpha = zeta = lam_sum = eta_sum = a = b_sum = 0.0
        for i in range(plays):
            upper, lower, value = lam[i] * x + eta * r[i], x - r[i], state[i]
            capped = upper < value
            value = upper if capped else value
            pushed = lower > value
            value = lower if pushed else value
            slope = -1.0 if pushed else (eta if capped else by_r[i])
            at = 0.0 if pushed else (x if capped else by_lam[i])
            width = 0.0 if pushed else (r[i] if capped else by_eta[i])
            state[i], by_r[i], by_lam[i], by_eta[i] = value, slope, at, width
            moved = p[i] * (slope - b * value)  # p falls with r, below Eq. (14)
            alpha += moved * share[i]
            zeta += moved
            lam_sum += p[i] * at
            eta_sum += p[i] * width
            a += decay[i] * value
            b_sum -= r[i] * p[i] * value
        row = out[t]
        row[0] = weight * alpha
        row[1] = weight * zeta * freq
        if shared:
            row[2] = weight * lam_sum
        else:
            for i in range(plays):
                row[2 + i] = weight * p[i] * by_lam[i]
        row[2 + lams] = weight * eta_sum
        row[3 + lams] = weight * a
        row[4 + lams] = weight * b_sum
        power = weight
        for k in range(order):
            power *= x
            row[5 + lams + k] = power
        row[5 + lams + order] = weight


@numba.njit(cache=True)
def jacobian(values, shape, runs):
    """Derivatives of `residuals`, "samples parameters"."""
    count, length = runs.u.shape
    out = np.empty((count * length, values.size))
    eta, b = values[2 + shape.lams], values[4 + shape.lams]
    rank = np.arange(1, shape.plays + 1) / shape.plays
    for k in range(count):
        r, lam, _, p = unpack(values, shape, runs.freq[k], runs.u_pp[k])
        _fill(
            runs.u[k],
            r,
            lam,
            eta,
            p,
            b,
            runs.u_min[k],
            rank * runs.u_pp[k] / 2,
            runs.freq[k],
            runs.weight[k],
            shape.lams == 1,
            out[k * length : (k + 1) * length],
        )
    return out
