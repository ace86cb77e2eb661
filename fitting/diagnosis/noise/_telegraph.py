"""Jumps in what does not repeat with the scan: telegraph noise.

Its spectrum is that of slow Gaussian noise, so no test of the spectrum sees it. What tells the two
apart is how the levels change: Gaussian noise of any colour changes by normal steps, jumps change
seldom and by much. Jumps some ten readings apart make no level that lasts: two tests must agree,
steps with heavier tails than normal ones between values with lighter tails, as two levels have.
Gaussian noise has neither, and wrong readings or noise that swells have heavy tails in both.

Where clock or drive wander from period to period the readings differ by the response's slope times
that delay, on steep flanks alone: these are left out, since levels last on flat parts as well.
"""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline
from scipy.ndimage import maximum_filter, median_filter
from scipy.stats import kurtosistest, norm

from ._periods import PeriodBlock
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class RandomJumps:
    """Whether levels change by steps with heavier tails than normal ones.

    - `p_value`: of the largest excess kurtosis over all lengths, adjusted for their number.
    - `size`: median of the steps beyond four standard deviations, each where it is largest, in the
      response's unit; 0 where there is none.
    """

    p_value: float
    size: float

    @property
    def sure(self) -> bool:
        """Whether chance is no explanation."""
        return self.p_value < THRESHOLDS.jump_p_value


def find_random_jumps(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock]
) -> RandomJumps:
    """Of model less data, less what repeats from period to period, off steep flanks.

    A step is the mean of some samples less that of as many before. The mean of the steps before and
    after is taken off, so that what drifts or settles makes none; nor does a single wrong reading.
    """
    # The first period of a run may differ by what it remembers, not by chance.
    settled = [error[1:] if len(error) > 2 else error for error in errors]
    parts = [
        (_without_outliers(_without_repetition(error)[:, _flat(error, block)].ravel()), len(error))
        for error, block in zip(settled, blocks, strict=True)
        if block.periods > 1 and np.ptp(error) > 0
    ]
    lengths = [THRESHOLDS.level_samples * 2**k for k in range(THRESHOLDS.level_lengths)]
    found = [_steps_of_all(parts, length) for length in lengths]
    tests = [(_p_value(unit, length, free), size) for unit, size, length, free in found if unit]
    levels = _p_value_of_levels(parts)
    for length in (1, 2, 4):
        unit, size, _, free = _steps_of_all(parts, length)
        tests += [(max(_p_value(unit, length, free), levels), size)] if unit else []
    if not tests:
        return RandomJumps(1.0, 0.0)
    p, size = min(tests)
    return RandomJumps(min(p * len(tests), 1.0), size)


def _without_repetition(error: Float[np.ndarray, "periods phases"]) -> Float[np.ndarray, "_ _"]:
    """Less the mean over periods of what is left of a slow course.

    The course is the smooth one whose means over each period are those of `error`. Were it left in,
    its part within a period would go into the mean over periods, and a step from each period to the
    next would stay: a drift would look like jumps.
    """
    periods, phases = error.shape
    error = error - error.mean(axis=0)
    edges = np.arange(periods + 1) * float(phases)
    whole = np.concatenate([[0.0], np.cumsum(error.sum(axis=1))])
    course = CubicSpline(edges, whole).derivative()(np.arange(error.size) + 0.5)
    rest = error - course.reshape(error.shape)
    return rest - rest.mean(axis=0)


def _flat(
    error: Float[np.ndarray, "periods phases"], block: PeriodBlock
) -> Bool[np.ndarray, " phases"]:
    """Phases at which the response is not much steeper than in most of the period.

    By the model, which has no noise. At least half of them are.
    """
    model = error.mean(axis=0) + block.data[-len(error) :].mean(axis=0)
    slope = np.abs(np.roll(model, -1) - np.roll(model, 1))
    return slope <= THRESHOLDS.steep_slope * np.median(slope)


def _without_outliers(row: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
    """Readings far from the median of their neighbours, put nearer."""
    middle = median_filter(row, size=THRESHOLDS.level_samples, mode="nearest")
    off = row - middle
    far = THRESHOLDS.outlier_sigmas * _NORMAL * float(np.median(np.abs(off)))
    return middle + np.clip(off, -far, far)


def _steps_of_all(
    parts: list[tuple[np.ndarray, int]], length: int
) -> tuple[list[np.ndarray], float, int, float]:
    """Steps of each run in standard deviations; their size if far; length; share of free ones."""
    units, far, free, count = [], [], 0.0, 0
    for row, periods in parts:
        step = _steps(row, length)
        if step.size < THRESHOLDS.least_steps * length or not np.ptp(step) > 0:
            continue
        spread = _NORMAL * float(np.median(np.abs(step)))
        units.append((step - step.mean()) / step.std())
        peak = np.abs(step) == maximum_filter(np.abs(step), size=2 * length + 1)
        peak &= np.abs(step) > THRESHOLDS.outlier_sigmas * spread
        # Less the mean over periods a step is lowered where it is, and seen in the others, smaller.
        far.append(np.abs(step[peak]) * periods / (periods - 1.0))
        free += step.size * (1.0 - 1.0 / periods)  # their mean over periods is zero
        count += step.size
    most = np.concatenate([*far, np.zeros(0)])
    size = 0.0
    if most.size:
        most = most[most > THRESHOLDS.own_step * np.quantile(most, 0.9)]
        size = float(np.median(most))
    return units, size, length, free / max(count, 1)


def _p_value_of_levels(parts: list[tuple[np.ndarray, int]]) -> float:
    """One-sided, of values with lighter tails than normal ones."""
    least = THRESHOLDS.least_steps
    rows = [(row, periods) for row, periods in parts if row.size >= least and np.ptp(row) > 0]
    if not rows:
        return 1.0
    count = sum(row.size for row, _ in rows)
    free = sum(row.size * (1.0 - 1.0 / periods) for row, periods in rows) / count
    return _p_value([row / row.std() for row, _ in rows], 1, free, lighter=True)


def _steps(row: Float[np.ndarray, " samples"], length: int) -> Float[np.ndarray, " steps"]:
    """At each sample that has room for them."""
    total = np.concatenate([[0.0], np.cumsum(row)])
    mean = (total[length:] - total[:-length]) / length
    step = mean[length:] - mean[:-length]
    apart = 2 * length
    if step.size <= 2 * apart:
        return np.zeros(0)
    return step[apart:-apart] - (step[: -2 * apart] + step[2 * apart :]) / 2.0


def _p_value(units: list[np.ndarray], length: int, free: float, *, lighter: bool = False) -> float:
    """One-sided, of excess kurtosis or its lack; neighbours that go together count for fewer."""
    every = max(length // THRESHOLDS.level_samples, 1)  # the rest is nearly the same again
    thin = [unit[::every] for unit in units]
    reach = range(1, 8 * THRESHOLDS.level_samples)
    pairs = [sum(float(u[k:] @ u[:-k]) for u in thin if u.size > k) for k in reach]
    power = sum(float(u @ u) for u in thin)
    alike = 1.0 + 2.0 * sum((pair / power) ** 4 for pair in pairs)
    # The same statistic of fewer independent steps is as much less sure.
    statistic = float(kurtosistest(np.concatenate(thin)).statistic)
    statistic = -statistic if lighter else statistic
    return float(norm.sf(statistic / np.sqrt(alike / free)))


_NORMAL = 1.4826  # standard deviation over median absolute deviation of normal numbers
