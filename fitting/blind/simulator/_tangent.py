"""What a hysteresis base can absorb: the tangent space of a device's own base, by differences."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg

from ._other_hysteresis import Actuator, absorbed_columns
from ._piezo import Piezo
from ._plays import play_memory, stretch_index, turning_points
from ._scan import Scan

Array = npt.NDArray[np.float64]
GROUPS = 12
NUDGE = 2e-3  # V of threshold, and as much of lambda and eta
CUT = 1e-4  # singular directions below this part of the largest cannot be used


@dataclass(frozen=True, eq=False)
class Tangent:
    """An orthonormal basis, over the period means of all runs, of what the base absorbs."""

    basis: Array  # (samples of one period of every run, directions)
    scans: tuple[Scan, ...]

    def left(self, difference: Sequence[Array]) -> float:
        """Rms in GHz over all samples after projection of the period means off the base.

        What differs from period to period is out of the base's reach, and counts as it is.
        """
        means, rest, count = [], 0.0, 0
        for scan, d in zip(self.scans, difference, strict=True):
            folded = d.reshape(scan.periods, scan.samples)
            mean = folded.mean(axis=0)
            rest += float(np.sum((folded - mean) ** 2))
            means.append(mean * np.sqrt(scan.periods))
            count += d.size
        g = np.concatenate(means)
        g = g - self.basis @ (self.basis.T @ g)
        return float(np.sqrt((g @ g + rest) / count))


def base_tangent(piezo: Actuator, scans: Sequence[Scan], oversample: int) -> Tangent:
    """The tangent space at `piezo`, each run weighted by the root of its number of periods.

    Of an actuator of another family: what a flexible sum of plays absorbs of its runs.
    """
    columns = [
        np.sqrt(s.periods)
        * (
            _columns(piezo, s, oversample)
            if isinstance(piezo, Piezo)
            else absorbed_columns(s, oversample)
        )
        for s in scans
    ]
    stacked = np.concatenate(columns)
    stacked /= np.maximum(np.linalg.norm(stacked, axis=0), 1e-12)
    try:
        left, values, _ = np.linalg.svd(stacked, full_matrices=False)
    except np.linalg.LinAlgError:  # the fast driver gives up on a few; the other one does not
        left, values, _ = scipy.linalg.svd(stacked, full_matrices=False, lapack_driver="gesvd")
    return Tangent(left[:, values > CUT * values[0]], tuple(scans))


def _columns(piezo: Piezo, scan: Scan, oversample: int) -> Array:
    """Derivatives of one settled period by the base's parameters, shape (samples, parameters).

    Parameters: the polynomial to the fourth order; for each group of neighbouring operators the
    weight, its fall with the threshold, the threshold's two laws (swing and rate), lambda, eta.
    """
    fine = scan.samples * oversample
    u = scan.voltage((np.arange(2 * fine + 1) - fine) * scan.step_s / oversample)
    ends = turning_points(u)
    rows = fine + oversample * np.arange(scan.samples)
    v, where = u[rows], stretch_index(ends, len(u))[rows]
    r = piezo.thresholds(scan.rate_hz, scan.swing)

    def plays(threshold: Array, lam: Array, eta: Array) -> Array:
        held = play_memory(u, ends, (threshold,), (lam, eta * threshold), piezo.curvature)
        high = v[:, None] * lam + eta * threshold + piezo.curvature * ((v - 3) ** 2)[:, None]
        return np.maximum(v[:, None] - threshold, np.minimum(high, held[where]))

    p, n = piezo.weights(r), len(r)
    here = plays(r, piezo.lam, piezo.eta)

    def by(dr: float, dlam: float, deta: float) -> Array:
        up = plays(r + dr, piezo.lam + dlam, piezo.eta + deta)
        down = plays(r - dr, piezo.lam - dlam, piezo.eta - deta)
        return (up - down) / (2 * NUDGE)

    group = np.arange(n) * min(n, GROUPS) // n
    gather = (group[:, None] == np.arange(group[-1] + 1)).astype(float)
    wide = by(NUDGE, 0.0, 0.0) * p
    parts = [
        v[:, None] ** np.arange(5),
        (here * p) @ gather,
        (here * p * r) @ gather,
        wide @ gather * scan.swing,
        wide @ gather * scan.rate_hz,
        (by(0.0, NUDGE, 0.0) * p) @ gather,
        (by(0.0, 0.0, NUDGE) * p * r) @ gather,
    ]
    return np.concatenate(parts, axis=1)
