"""Where a sampled drive turns sharply: the turning points between its samples."""

import numpy as np
from jaxtyping import Float

_SIDE = 6  # samples on either side through which a straight line must go
_STRAIGHT = 5e-3  # of their rise: how far they may lie off it
_SAME = 1e-6  # of a step: a corner this near a sample is that sample


def corners(
    time: Float[np.ndarray, " time"], value: Float[np.ndarray, " time"]
) -> tuple[Float[np.ndarray, " corners"], Float[np.ndarray, " corners"]]:
    """Times and values of the sharp turning points that lie between samples.

    A turning point counts where the samples on either side lie on two straight lines; it stands
    where these meet. One that falls on a sample, and a smooth turn, add nothing.
    """
    slope = np.diff(value) / np.diff(time)
    turn = np.flatnonzero((slope[:-1] * slope[1:] <= 0) & (slope[:-1] != slope[1:])) + 1
    found = []
    for i in turn:
        corner = _meeting(time, value, int(i))
        if corner is None:
            continue
        # Midway between two samples both of them are an extreme.
        if not found or corner[0] > found[-1][0] + _SAME * (time[i] - time[i - 1]):
            found.append(corner)
    out = np.array(found).reshape(-1, 2)
    return out[:, 0], out[:, 1]


def _meeting(time: np.ndarray, value: np.ndarray, i: int) -> tuple[float, float] | None:
    """The corner near sample `i`, an extreme: it lies in the step before or after it."""
    for last in (i, i - 1):  # the last sample before the corner
        before = slice(last - _SIDE + 1, last + 1)
        after = slice(last + 1, last + 1 + _SIDE)
        if before.start < 0 or after.stop > time.size:
            continue
        first, second = (_line(time[part] - time[i], value[part]) for part in (before, after))
        if first is None or second is None:
            continue
        (a, b), (c, d) = first, second
        if a == c:
            continue
        at = (d - b) / (a - c) + time[i]
        step = time[last + 1] - time[last]
        if time[last] + _SAME * step < at < time[last + 1] - _SAME * step:
            return at, a * (at - time[i]) + b
    return None


def _line(time: np.ndarray, value: np.ndarray) -> tuple[float, float] | None:
    """Slope and intercept, or nothing where the points are not on one line, or the line is flat."""
    slope, intercept = np.polyfit(time, value, 1)
    off = np.abs(value - slope * time - intercept).max()
    rise = abs(slope) * (time[-1] - time[0])
    return (float(slope), float(intercept)) if rise > 0 and off <= _STRAIGHT * rise else None
