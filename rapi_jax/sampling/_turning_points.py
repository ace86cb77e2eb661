"""The phase at which a repeating signal turns, finer than its samples (host side, NumPy).

A triangle turns at a corner, a sine at a vertex. Where the slopes on the two sides of the lowest
bin of the folded signal differ, two lines meet there, or two parabolas, whichever has the lower
Bayesian information criterion; else a polynomial of order 4, 6 or 8 has its lowest place there. A
mean over bins alone has the turn to a bin, and that of a corner with unequal sides on the flatter
one.
"""

from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float

from ._thresholds import THRESHOLDS

_SIDES = (1, 2)  # orders of the polynomials of either side of a corner
_SMOOTH = (4, 6, 8)  # and of a smooth turn


def refine_minimum(
    phase: Float[np.ndarray, " time"],
    value: Float[np.ndarray, " time"],
    mean: Float[np.ndarray, " bins"],
) -> float:
    """The phase (0 to 1) of the minimum of `value`, which repeats with every unit of `phase`.

    `mean` is `value` folded into equal bins of a period, from phase 0. Where the samples about its
    lowest bin do not tell a turn, as on a plateau, that bin's middle is returned.
    """
    lowest = int(np.argmin(mean))
    coarse = (lowest + 0.5) / mean.size
    step = np.ptp(phase) / max(1, phase.size - 1)
    guard = max(1.01 * step, THRESHOLDS.turn_guard)
    for left, right in _windows(mean, lowest):
        x = np.mod(phase - coarse + 0.5, 1.0) - 0.5
        near = (x > -left) & (x < right) & np.isfinite(value)
        x, y = x[near], value[near]
        for bins in THRESHOLDS.lowest_bin:
            first = max(guard, bins / mean.size)
            distinct = min(_distinct(side, step) for side in (x[x < -first], x[x > first]))
            if distinct >= THRESHOLDS.turn_samples:
                found = 0.0
                for beside in (first, guard):  # again from where the first one ends
                    move = _turn(x - found, y, beside, guard, float(np.ptp(mean)), 2 * distinct)
                    if move is None:
                        return coarse
                    found += move
                return (coarse + found) % 1.0
    return coarse


def _windows(mean: np.ndarray, lowest: int) -> Iterator[tuple[float, float]]:
    """How far the samples to fit reach on either side of the lowest bin, in periods."""
    ordered = np.roll(mean, -lowest)
    for share in THRESHOLDS.turn_rises:
        above = np.flatnonzero(ordered > mean.min() + share * np.ptp(mean))
        if above.size:
            right, left = int(above[0]), mean.size - int(above[-1])
            yield left / mean.size, right / mean.size


def _distinct(x: np.ndarray, step: float) -> int:
    """How many samples are at places of their own: whole periods may repeat the same ones."""
    return np.unique(np.round(4.0 * x / step)).size if step > 0 else 0


def _turn(
    x: np.ndarray, y: np.ndarray, first: float, guard: float, swing: float, distinct: int
) -> float | None:
    """Where the curves about 0 turn, from the samples `x` (in periods) and `y`; None if nowhere."""
    width = float(np.abs(x).max())
    sides = x < -first, x > first
    slopes = [_fit(x[side] / width, y[side], 2)[1] for side in sides]
    sharp = slopes[1] - slopes[0] > THRESHOLDS.turn_slope * swing * width
    rounding = THRESHOLDS.turn_rounding * swing
    if sharp:
        order = _order([(x[side] / width, y[side]) for side in sides], _SIDES, rounding)
    else:
        orders = [order for order in _SMOOTH if order == _SMOOTH[0] or 2 * order <= distinct]
        order = _order([(x / width, y)], orders, rounding)
    at, end = 0.0, (float(x.min()), float(x.max()))
    for _ in range(THRESHOLDS.turn_passes):
        far = x - at
        if sharp:
            move = _meeting(far / width, y, guard / width, order)
        else:
            use = np.abs(far) <= min(at - end[0], end[1] - at)
            move = _vertex(far[use] / width, y[use], order)
        if move is None or not end[0] < at + width * move < end[1]:
            return None
        at += width * move
        if abs(width * move) < THRESHOLDS.near_sample:
            break
    return at


def _order(
    parts: Sequence[tuple[np.ndarray, np.ndarray]], orders: Sequence[int], rounding: float
) -> int:
    """The order of lowest Bayesian information criterion, of one polynomial for each part."""
    count = sum(x.size for x, _ in parts)

    def score(order: int) -> float:
        square = sum(_misfit(x, y, order) for x, y in parts)
        fitted = len(parts) * (order + 1)
        return count * float(np.log(square / count + rounding**2)) + fitted * float(np.log(count))

    return min(orders, key=score)


def _fit(x: np.ndarray, y: np.ndarray, order: int) -> np.ndarray:
    """Coefficients of a polynomial, of the highest power first."""
    return np.linalg.lstsq(np.vander(x, order + 1), y, rcond=None)[0]


def _misfit(x: np.ndarray, y: np.ndarray, order: int) -> float:
    y = y - y.mean()
    return float(np.sum((y - np.polyval(_fit(x, y, order), x)) ** 2))


def _meeting(x: np.ndarray, y: np.ndarray, guard: float, order: int) -> float | None:
    """Where the falling side meets the rising one."""
    left, right = x < -guard, x > guard
    if min(left.sum(), right.sum()) <= order:
        return None
    one, other = _fit(x[left], y[left], order), _fit(x[right], y[right], order)
    roots = np.roots(one - other)
    roots = roots[np.abs(roots.imag) < 1e-9].real
    return float(roots[np.argmin(np.abs(roots))]) if roots.size else None


def _vertex(x: np.ndarray, y: np.ndarray, order: int) -> float | None:
    """The lowest place nearest to 0 of the polynomial through all samples."""
    if x.size <= order:
        return None
    slope = np.polyder(_fit(x, y, order))
    roots = np.roots(slope)
    roots = roots[np.abs(roots.imag) < 1e-9].real
    roots = roots[np.polyval(np.polyder(slope), roots) > 0.0]
    return float(roots[np.argmin(np.abs(roots))]) if roots.size else None
