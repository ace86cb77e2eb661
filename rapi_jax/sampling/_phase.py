"""Periods, branches and regions of interest of a repeating or a free drive (host side, NumPy)."""

import numpy as np

from ._thresholds import THRESHOLDS
from ._turning_points import refine_minimum


def fold(phase: np.ndarray, value: np.ndarray, bins: int) -> np.ndarray:
    """The mean of `value` in equal bins of `phase` modulo 1, smoothed over three; NaN-aware."""
    index = np.minimum((np.mod(phase, 1.0) * bins).astype(int), bins - 1)
    good = np.isfinite(value)
    count = np.bincount(index[good], minlength=bins)
    total = np.bincount(index[good], weights=value[good], minlength=bins)
    if (count == 0).any():  # fewer samples than bins somewhere: carry the neighbour's
        filled = np.flatnonzero(count)
        nearest = filled[np.abs(np.arange(bins)[:, None] - filled[None, :]).argmin(axis=1)]
        mean = total[nearest] / count[nearest]
    else:
        mean = total / count
    return (np.roll(mean, 1) + 2 * mean + np.roll(mean, -1)) / 4


def turning_phases(phase: np.ndarray, value: np.ndarray) -> tuple[float, float]:
    """Phases (0 to 1) at which a repeating signal has its minimum and its maximum.

    Without noise and at 200 samples a period or more, those of a triangle and of a sine are right
    to 1e-4 of a period.
    """
    per_period = max(1, int(phase.size / max(1.0, np.ptp(phase))))
    mean = fold(phase, value, int(np.clip(per_period, 16, 200)))
    return refine_minimum(phase, value, mean), refine_minimum(phase, -value, -mean)


def are_whole_samples(periods: float | int, exact: float, samples: float | int) -> bool:
    """Whether `periods` periods, of `exact` samples each, are `samples` samples, near enough."""
    return abs(periods * exact - samples) <= THRESHOLDS.whole_periods


def whole_period(value: np.ndarray, exact: float, u_pp: float) -> int:
    """Samples a period of the drive `value`, if `exact` is near enough a whole number; else 0.

    And if the drive repeats exactly, beside its peak-to-peak value `u_pp`.
    """
    count = round(exact)
    if not 8 <= count <= value.size:
        return 0
    if not are_whole_samples(value.size / count, exact, value.size):
        return 0
    again = value[count:] - value[:-count]
    most = max(again.max(initial=0.0), -again.min(initial=0.0))
    return count if most <= THRESHOLDS.repeat_error * u_pp else 0


def complete_periods(cycles: np.ndarray, anchor: float) -> np.ndarray:
    """The period of each sample, counted from 0; -1 in a broken period at either end.

    `cycles` is time times scan rate. Periods begin at phase `anchor`; where none is complete so,
    they begin with the record.
    """
    step = (cycles[-1] - cycles[0]) / max(1, cycles.size - 1)
    anchor = 0.0 if min(anchor, 1.0 - anchor) < max(THRESHOLDS.period_edge, 0.75 * step) else anchor
    for begin in (anchor, 0.0):
        period = np.floor(cycles - begin + step / 2).astype(int)
        first = 0 if begin == 0.0 else int(np.ceil(cycles[0] - begin - step / 2))
        last = int(np.floor(cycles[-1] - begin + 1.5 * step))  # periods before it are complete
        period = np.where((period >= first) & (period < last), period - first, -1)
        if (period >= 0).any():
            return period
    return np.full(cycles.shape, -1)


def turning_samples(value: np.ndarray, tolerance: float = 0.01) -> np.ndarray:
    """Samples at which a free signal turns, by at least `tolerance` of its span; ends included."""
    dead = tolerance * np.ptp(value)
    numbers = value.tolist()
    turns = [0]
    direction, low, high = 0, 0, 0  # samples of the extremes since the last turn
    for i, x in enumerate(numbers):
        low = i if x < numbers[low] else low
        high = i if x > numbers[high] else high
        if direction >= 0 and numbers[high] - x > dead:
            turns += [high] if direction else []  # before the first branch nothing has turned
            direction, low = -1, i
        elif direction <= 0 and x - numbers[low] > dead:
            turns += [low] if direction else []
            direction, high = 1, i
    turns.append(value.size - 1)
    return np.unique(turns)


def branch_fraction(phase: np.ndarray, low: float, high: float) -> tuple[np.ndarray, np.ndarray]:
    """Whether each sample is on the rising branch, and how far along its branch it is (0 to 1).

    A sample on a turning point, but for rounding, begins a branch.
    """
    rise, near = np.mod(high - low, 1.0), THRESHOLDS.near_sample
    since = np.maximum(np.mod(phase - low + near, 1.0) - near, 0.0)
    up = since < rise - near
    since = np.where(up, since, np.maximum(since, rise))
    along = np.where(up, since / max(rise, 1e-12), (since - rise) / max(1.0 - rise, 1e-12))
    return up, along


def segment_fraction(turns: np.ndarray, value: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same for a free signal, between its turning samples."""
    up = np.zeros(value.size, dtype=bool)
    along = np.zeros(value.size)
    for begin, end in zip(turns[:-1], turns[1:], strict=True):
        part = slice(begin, end + 1)
        up[part] = value[end] > value[begin]
        along[part] = np.linspace(0.0, 1.0, end + 1 - begin)
    return up, along
