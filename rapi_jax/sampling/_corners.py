"""Where a sampled drive turns sharply: the turning points between its samples."""

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from rapi_jax.plays._monotone_stretches import direction_changes

from ._thresholds import THRESHOLDS


def corners(
    value: Float[np.ndarray, " time"],
) -> tuple[Float[np.ndarray, " corners"], Float[np.ndarray, " corners"]]:
    """Places, in steps from the first sample, and values of the sharp turns between samples.

    A turning point counts where the samples on either side lie on two straight lines; it stands
    where these meet. One that falls on a sample, and a smooth turn, add nothing. Beyond its ends a
    signal goes on as straight as between its last two samples.
    """
    if value.size < 2:
        return np.empty(0), np.empty(0)
    beyond = THRESHOLDS.corner_samples
    turn = direction_changes(value) + beyond
    on = np.arange(1, beyond + 1)
    before = value[0] - (value[1] - value[0]) * on[::-1]
    after = value[-1] + (value[-1] - value[-2]) * on
    # Near an extreme a corner lies in the step after it, or else in the one before.
    longer = np.concatenate([before, value, after])
    found = _meeting(longer, np.tile(turn, 2), np.concatenate([turn, turn - 1]))
    there, at, height = (part.reshape(2, -1) for part in found)
    at, height = (np.where(there[0], part[0], part[1]) for part in (at, height))
    kept: list[int] = []
    for k in np.flatnonzero(there.any(axis=0)):
        # Midway between two samples both of them are an extreme.
        if not kept or at[k] > at[kept[-1]] + THRESHOLDS.same_sample:
            kept.append(int(k))
    return at[kept] - beyond, height[kept]


def periodic_corners(
    value: Float[np.ndarray, " time"],
) -> tuple[Float[np.ndarray, " corners"], Float[np.ndarray, " corners"]]:
    """The same of one period of a drive, from 0 on."""
    beside = THRESHOLDS.corner_samples + 2
    before, after = (
        np.take(value, steps, mode="wrap") for steps in (np.arange(-beside, 0), np.arange(beside))
    )
    at, height = corners(np.concatenate([before, value, after]))
    at = at - beside
    near = THRESHOLDS.near_sample
    inside = (at >= -near) & (at < value.size - near)
    return at[inside], height[inside]


def _meeting(
    value: np.ndarray, turn: np.ndarray, last: np.ndarray
) -> tuple[Bool[np.ndarray, " turns"], Float[np.ndarray, " turns"], Float[np.ndarray, " turns"]]:
    """Corners in the steps that follow the samples `last`: whether there is one, place and value.

    Lines are told about the samples `turn`, so that no digits are lost far from the first sample.
    """
    count = THRESHOLDS.corner_samples
    inside = (last >= count - 1) & (last + count < value.size)
    if not inside.any():
        none = np.zeros(turn.size)
        return none.astype(bool), none, none
    last = np.where(inside, last, last[inside][0])
    begin = np.concatenate([last - count + 1, last + 1])
    lines = (part.reshape(2, -1) for part in _lines(value, begin, np.tile(turn, 2)))
    (a, c), (b, d), (one, other) = lines
    there = inside & one & other & (a != c)
    at = (d - b) / np.where(there, a - c, 1.0)
    left, near = (last - turn).astype(float), THRESHOLDS.same_sample
    there &= (left + near < at) & (at < left + 1.0 - near)
    return there, at + turn, a * at + b


def _lines(
    value: np.ndarray, begin: Int[np.ndarray, " lines"], origin: Int[np.ndarray, " lines"]
) -> tuple[Float[np.ndarray, " lines"], Float[np.ndarray, " lines"], Bool[np.ndarray, " lines"]]:
    """Slopes, and values at `origin`, of the lines through six samples each from `begin` on.

    And whether the samples are on their line, and the line is not flat.
    """
    count = THRESHOLDS.corner_samples
    y = sliding_window_view(value, count)[begin]
    x = np.arange(count) - (count - 1) / 2.0
    level = y.mean(axis=1)
    y = y - level[:, None]
    slope = y @ x / (x @ x)
    off = np.abs(y - slope[:, None] * x).max(axis=1)
    rise = np.abs(slope) * (count - 1)
    return (
        slope,
        level + slope * (origin - begin - (count - 1) / 2.0),
        (rise > 0) & (off <= THRESHOLDS.corner_straightness * rise),
    )
