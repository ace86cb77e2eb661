"""Play operators over whole records at once.

An operator with rising bounds, `max(low(u), min(high(u), before))`, keeps this form over any
stretch in which the drive does not turn, with `before` the value at the stretch's beginning. So its
memory needs a step only at the turning points, and all between them is one array operation.
"""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.intp]


def turning_points(u: Array) -> Index:
    """Indices of the first sample, of the last before each change of direction, and of the last."""
    step = np.sign(np.diff(u))
    moving = np.flatnonzero(step)
    if len(moving) == 0:
        return np.array([0, len(u) - 1])
    turned = np.flatnonzero(step[moving][1:] != step[moving][:-1])
    return np.concatenate(([0], moving[turned + 1], [len(u) - 1]))


def play_memory(
    u: Array, ends: Index, low: tuple[Array, ...], high: tuple[Array, ...], curvature: float
) -> Array:
    """Values held over each stretch, shape (stretches, operators). The first sample is one alone.

    `low` is (r,): the bound `u - r`. `high` is (slope, offset): the bound
    `slope u + offset + bow (u - 3)^2`. The first value is that of Eq. (13): both bounds' larger one
    at the drive's minimum.
    """
    (r,), (slope, offset) = low, high
    least = float(np.min(u))
    value = np.maximum(least - r, slope * least + offset + curvature * (least - 3) ** 2)
    held = np.empty((len(ends), len(r)))
    for k, end in enumerate(ends):
        held[k] = value
        v = u[end]
        value = np.maximum(v - r, np.minimum(slope * v + offset + curvature * (v - 3) ** 2, value))
    return held


def stretch_index(ends: Index, length: int) -> Index:
    """For each sample the number of its stretch, shape (length,)."""
    return np.searchsorted(ends, np.arange(length), side="left")
