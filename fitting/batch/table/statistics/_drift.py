"""Parameters that drift over a session: a permutation test of the trend.

The statistic is the weighted slope over its heteroscedasticity-robust standard error, and its
distribution without drift is that over permutations of the times (DiCiccio and Romano 2017, *J.
Am. Stat. Assoc.* 112:1211-1220). It is exact where recordings are exchangeable, whatever their
distribution, and holds in large batches also where the scatter alone changes with time; the usual
standard error of a slope is neither. Values are drawn in to 3 robust standard deviations before,
so that one outlier neither makes nor hides a trend. A parameter that wanders counts as one that
drifts: recordings are taken to be independent.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting._multiple_tests import adjust_holm
from fitting.batch.table._thresholds import THRESHOLDS

from ._outliers import robust_scale

_BLOCK = 2**18  # numbers of permuted times held at once


@dataclasses.dataclass(frozen=True)
class Drift:
    """The trend of each parameter over the session.

    `change` is the slope times the length of the session, `stderr` its robust standard error (HC3),
    `raw` the p-value and `p` the same corrected for the number of parameters; `middle` is the value
    on the line at `mean_time`.
    """

    change: Float[np.ndarray, " parameters"]
    stderr: Float[np.ndarray, " parameters"]
    middle: Float[np.ndarray, " parameters"]
    mean_time: Float[np.ndarray, " parameters"]
    raw: Float[np.ndarray, " parameters"]
    p: Float[np.ndarray, " parameters"]


def find_drift(
    time: Float[np.ndarray, " recordings"],
    values: Float[np.ndarray, "recordings parameters"],
    stderr: Float[np.ndarray, "recordings parameters"],
    *,
    permutations: int = THRESHOLDS.permutations,
    seed: int = 0,
) -> Drift | None:
    """Test each parameter for a trend over `time` (any unit).

    **Arguments:**

    - `values`: finite; each parameter varies. `stderr`: one standard error each; finite.

    **Returns:** the trends; None with fewer than `fewest_in_time` recordings or one time for all.
    """
    n = len(time)
    if n < THRESHOLDS.fewest_in_time or np.ptp(time) <= 0 or not values.shape[1]:
        return None
    middle, spread = robust_scale(values)
    x = np.clip((values - middle) / spread, -THRESHOLDS.clip, THRESHOLDS.clip)
    error = stderr / spread
    scatter = np.maximum(1.0 - np.median(error**2, axis=0), 0.0)
    weight = 1.0 / np.maximum(scatter + error**2, np.median(scatter + error**2, axis=0))
    weight /= weight.mean(axis=0)
    t = (time - time.mean()) / np.ptp(time)
    y = weight * (x - np.sum(weight * x, axis=0) / weight.sum(axis=0))
    seen = np.abs(_studentised(t[None], y, weight)[0])
    rng, above = np.random.default_rng(seed), np.zeros(len(seen))
    rows = max(1, _BLOCK // n)
    for begin in range(0, permutations, rows):
        count = min(rows, permutations - begin)
        permuted = rng.permuted(np.broadcast_to(t, (count, n)), axis=1)
        # Equal arrangements differ by rounding.
        above += np.sum(np.abs(_studentised(permuted, y, weight)) >= seen * (1 - 1e-9), axis=0)
    raw = (1.0 + above) / (1.0 + permutations)
    slope, robust, centre = _fit_line(t, x, weight)
    return Drift(
        change=spread * slope,
        stderr=spread * robust,
        middle=middle + spread * np.sum(weight * x, axis=0) / weight.sum(axis=0),
        mean_time=time.mean() + np.ptp(time) * centre,
        raw=raw,
        p=adjust_holm(raw),
    )


def _studentised(t: np.ndarray, y: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Slope over its robust standard error for each order of times: `orders x parameters`."""
    centre = t @ weight / weight.sum(axis=0)
    square = (t**2) @ y**2 - 2.0 * centre * (t @ y**2) + centre**2 * np.sum(y**2, axis=0)
    return (t @ y) / np.sqrt(np.maximum(square, np.finfo(float).tiny))


def _fit_line(
    t: np.ndarray, x: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Weighted slope, its HC3 standard error and the weighted mean time, for each parameter."""
    total = weight.sum(axis=0)
    centre = t @ weight / total
    off = t[:, None] - centre
    power = np.sum(weight * off**2, axis=0)
    level = np.sum(weight * x, axis=0) / total
    slope = np.sum(weight * off * x, axis=0) / power
    residual = x - level - slope * off
    leverage = weight * (1.0 / total + off**2 / power)
    meat = (weight * off * residual / np.maximum(1.0 - leverage, 1e-6)) ** 2
    return slope, np.sqrt(np.sum(meat, axis=0)) / power, centre
