"""Where a sampled drive bends sharply: its corners, on samples and between them."""

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from ._thresholds import THRESHOLDS

Corners = tuple[Float[np.ndarray, " corners"], Float[np.ndarray, " corners"]]


def corners(value: Float[np.ndarray, " time"]) -> Corners:
    """Places, in steps from the first sample, and values of the corners between samples.

    See `bends`; a corner on a sample adds nothing.
    """
    return between(*bends(value))


def bends(value: Float[np.ndarray, " time"]) -> Corners:
    """The corners of a signal, those on samples, too.

    Where the samples on either side lie on two straight lines, level or not, a corner stands where
    these meet. A smooth turn is none. Beyond its ends a signal goes on as straight as between its
    last two samples.
    """
    if value.size < 2:
        return np.empty(0), np.empty(0)
    beyond = THRESHOLDS.corner_samples
    on = np.arange(1, beyond + 1)
    before = value[0] - (value[1] - value[0]) * on[::-1]
    after = value[-1] + (value[-1] - value[-2]) * on
    longer = np.concatenate([before, value, after])
    there, at, height = _meeting(longer, _bent_steps(longer))
    at, height = at[there] - beyond, height[there]
    # A corner on a sample ends one step and begins the next.
    kept = np.diff(at, prepend=-np.inf) > THRESHOLDS.same_sample
    kept &= (at > 0) & (at < value.size - 1)
    return at[kept], height[kept]


def between(at: Float[np.ndarray, " places"], height: Float[np.ndarray, " places"]) -> Corners:
    """Of places in steps those that are no samples, with their values."""
    off = np.abs(at - np.round(at)) > THRESHOLDS.same_sample
    return at[off], height[off]


def wrapped(value: Float[np.ndarray, " time"], beside: int) -> Float[np.ndarray, " longer"]:
    """One period with so many samples of the next ones on either side."""
    return np.take(value, np.arange(-beside, value.size + beside), mode="wrap")


def within_period(
    at: Float[np.ndarray, " places"], height: Float[np.ndarray, " places"], samples: int
) -> Corners:
    """Of places in steps those in one period of so many samples, with their values."""
    near = THRESHOLDS.near_sample
    inside = (at >= -near) & (at < samples - near)
    return at[inside], height[inside]


def _bent_steps(value: Float[np.ndarray, " time"]) -> Int[np.ndarray, " steps"]:
    """The samples before steps over which the slope changes far more than on either side."""
    rise = np.diff(value)
    change = np.abs(np.diff(rise))
    across = np.abs(rise[3:-1] - rise[1:-3])
    beside = change[:-3] + change[3:]
    least = THRESHOLDS.corner_change * np.abs(rise).max(initial=0.0)
    return np.flatnonzero(across > THRESHOLDS.corner_sharpness * beside + least) + 2


def _meeting(
    value: Float[np.ndarray, " time"], last: Int[np.ndarray, " steps"]
) -> tuple[Bool[np.ndarray, " steps"], Float[np.ndarray, " steps"], Float[np.ndarray, " steps"]]:
    """Corners in the steps that follow the samples `last`: whether there is one, place and value.

    Lines are told about these samples, so that no digits are lost far from the first one.
    """
    count = THRESHOLDS.corner_samples
    last = last[(last >= count - 1) & (last + count < value.size)]
    if not last.size:
        none = np.zeros(0)
        return none.astype(bool), none, none
    a, b, off_before, rise_before = _lines(value, last - count + 1, last)
    c, d, off_after, rise_after = _lines(value, last + 1, last)
    level = THRESHOLDS.corner_rounding * np.maximum(rise_before, rise_after)
    there = off_before <= THRESHOLDS.corner_straightness * rise_before + level
    there &= off_after <= THRESHOLDS.corner_straightness * rise_after + level
    off = np.maximum(off_before, off_after)
    there &= np.abs(a - c) * (count - 1) > THRESHOLDS.corner_angle * off + level
    at = (d - b) / np.where(there, a - c, 1.0)
    near = THRESHOLDS.same_sample
    there &= (at > -near) & (at < 1.0 + near)
    return there, at + last, a * at + b


def _lines(
    value: Float[np.ndarray, " time"],
    begin: Int[np.ndarray, " lines"],
    origin: Int[np.ndarray, " lines"],
) -> tuple[
    Float[np.ndarray, " lines"],
    Float[np.ndarray, " lines"],
    Float[np.ndarray, " lines"],
    Float[np.ndarray, " lines"],
]:
    """Slopes, and values at `origin`, of the lines through six samples each from `begin` on.

    And by how much samples lie off their line, and how far it rises along them.
    """
    count = THRESHOLDS.corner_samples
    y = sliding_window_view(value, count)[begin]
    x = np.arange(count) - (count - 1) / 2.0
    level = y.mean(axis=1)
    y = y - level[:, None]
    slope = y @ x / (x @ x)
    off = np.abs(y - slope[:, None] * x).max(axis=1)
    height = level + slope * (origin - begin - (count - 1) / 2.0)
    return slope, height, off, np.abs(slope) * (count - 1)
