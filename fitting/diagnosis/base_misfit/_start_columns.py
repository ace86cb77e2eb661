"""What the unknown start of a run may change, whatever the hysteresis: each change a column.

A run that does not repeat begins with plays somewhere in their bands. The identified operator's own
first outputs are fitted, but a device whose plays are others begins as none of them. Where the
drive has been at both ends of its range every play that it moves at all has met a bound, and the
start is forgotten (the wiping-out property of plays).
"""

import numpy as np
from jaxtyping import Bool, Float

from ._thresholds import THRESHOLDS


def start_columns(
    u: Float[np.ndarray, "runs grid"], known: Bool[np.ndarray, " runs"]
) -> Float[np.ndarray, "columns runs grid"]:
    """Functions that are linear between points of the way to both ends of the range, 0 after.

    And a constant for all of the run: what no drive moves stays as it began. `u`: drives, V.
    `known`: runs that repeat, and have none.
    """
    points = THRESHOLDS.start_points
    out = np.zeros(((points + 1) * int((~known).sum()), *u.shape))
    for place, k in enumerate(np.flatnonzero(~known).tolist()):
        rows = out[place * (points + 1) : (place + 1) * (points + 1), k]
        way = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(u[k])))])
        end = _both_ends(u[k])
        if way[end] > 0.0:
            at = way[: end + 1] / way[end] * (points - 1)
            rows[:-1, : end + 1] = np.maximum(1.0 - np.abs(at - np.arange(points)[:, None]), 0.0)
        rows[-1] = 1.0
    return out


def _both_ends(u: Float[np.ndarray, " grid"]) -> int:
    """The first sample by which the drive has been at both ends of its range."""
    near = THRESHOLDS.range_end * float(np.ptp(u))
    return max(int(np.argmax(u <= u.min() + near)), int(np.argmax(u >= u.max() - near)))
