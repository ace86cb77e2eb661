"""Where a sampled drive turns sharply: the turning points between its samples."""

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from ._thresholds import THRESHOLDS


def corners(
    time: Float[np.ndarray, " time"], value: Float[np.ndarray, " time"]
) -> tuple[Float[np.ndarray, " corners"], Float[np.ndarray, " corners"]]:
    """Times and values of the sharp turning points that lie between samples.

    A turning point counts where the samples on either side lie on two straight lines; it stands
    where these meet. One that falls on a sample, and a smooth turn, add nothing.
    """
    rises, falls = value[1:] > value[:-1], value[1:] < value[:-1]
    turn = np.flatnonzero((rises[1:] != rises[:-1]) | (falls[1:] != falls[:-1])) + 1
    # Near an extreme a corner lies in the step after it, or else in the one before.
    found = _meeting(time, value, np.tile(turn, 2), np.concatenate([turn, turn - 1]))
    there, at, height = (part.reshape(2, -1) for part in found)
    at, height = (np.where(there[0], part[0], part[1]) for part in (at, height))
    there = there.any(axis=0)
    kept: list[int] = []
    for k in np.flatnonzero(there):
        step = time[turn[k]] - time[turn[k] - 1]
        # Midway between two samples both of them are an extreme.
        if not kept or at[k] > at[kept[-1]] + THRESHOLDS.same_sample * step:
            kept.append(int(k))
    return at[kept], height[kept]


def periodic_corners(
    value: Float[np.ndarray, " time"],
) -> tuple[Float[np.ndarray, " corners"], Float[np.ndarray, " corners"]]:
    """The same of one period of a drive, in steps from its first sample, from 0 on."""
    beside = THRESHOLDS.corner_samples + 2
    around = np.take(value, np.arange(-beside, 0), mode="wrap"), value
    around = np.concatenate([*around, np.take(value, np.arange(beside), mode="wrap")])
    at, height = corners(np.arange(around.size) - float(beside), around)
    near = THRESHOLDS.near_sample
    inside = (at >= -near) & (at < value.size - near)
    return at[inside], height[inside]


def _meeting(
    time: np.ndarray, value: np.ndarray, turn: np.ndarray, last: np.ndarray
) -> tuple[Bool[np.ndarray, " turns"], Float[np.ndarray, " turns"], Float[np.ndarray, " turns"]]:
    """Corners in the steps that follow the samples `last`: whether there is one, time and value."""
    inside = (last >= THRESHOLDS.corner_samples - 1) & (
        last + THRESHOLDS.corner_samples < time.size
    )
    if not inside.any():
        none = np.zeros(turn.size)
        return none.astype(bool), none, none
    last = np.where(inside, last, last[inside][0])
    origin = time[turn]
    begin = np.concatenate([last - THRESHOLDS.corner_samples + 1, last + 1])
    lines = (part.reshape(2, -1) for part in _lines(time, value, begin, np.tile(origin, 2)))
    (a, c), (b, d), (one, other) = lines
    there = inside & one & other & (a != c)
    at = (d - b) / np.where(there, a - c, 1.0)
    left, right = time[last], time[last + 1]
    near = THRESHOLDS.same_sample * (right - left)
    there &= (left + near < at + origin) & (at + origin < right - near)
    return there, at + origin, a * at + b


def _lines(
    time: np.ndarray, value: np.ndarray, begin: Int[np.ndarray, " lines"], origin: np.ndarray
) -> tuple[Float[np.ndarray, " lines"], Float[np.ndarray, " lines"], Bool[np.ndarray, " lines"]]:
    """Slopes, and values at `origin`, of the lines through six samples each from `begin` on.

    And whether the samples are on their line, and the line is not flat.
    """
    x, y = (sliding_window_view(row, THRESHOLDS.corner_samples)[begin] for row in (time, value))
    middle, level = x.mean(axis=1), y.mean(axis=1)
    x, y = x - middle[:, None], y - level[:, None]
    slope = np.sum(x * y, axis=1) / np.sum(x * x, axis=1)
    off = np.abs(y - slope[:, None] * x).max(axis=1)
    rise = np.abs(slope) * (x[:, -1] - x[:, 0])
    return (
        slope,
        level + slope * (origin - middle),
        (rise > 0) & (off <= THRESHOLDS.corner_straightness * rise),
    )
