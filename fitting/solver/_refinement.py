"""A Gauss-Newton step tried at several lengths: whether a fit that came to rest can go on.

At a kink of the residuals the gradient jumps and promises a decrease that no step keeps. So the
decrease is measured, not predicted.
"""

from collections.abc import Callable

import numpy as np

from ._identifiability import is_determined, qr_factor
from ._thresholds import THRESHOLDS

_SHARES = (1.0, 0.3, 0.1, 0.03, 0.01)  # of a whole step


def try_gauss_newton_step(
    values: np.ndarray,
    residual: np.ndarray,
    jacobian: np.ndarray,
    *,
    residual_at: Callable[[np.ndarray], np.ndarray],
    project: Callable[[np.ndarray, np.ndarray], np.ndarray],
    least: float = 0.0,
) -> tuple[float, np.ndarray]:
    """The share of the cost that a step from `values` takes away, and where it leads.

    **Arguments:**

    - `residual`, `jacobian`: at `values`; a column of zeros is a value that does not move.
    - `residual_at`: the residuals at other values, in any shape.
    - `project(values, moves)`: `values` with those that move brought inside their bounds.
    - `least`: a step whose linearised problem promises less than this share of the cost is not
      tried, and gains nothing.
    """
    length = np.linalg.norm(jacobian, axis=0)
    moves = length > 0
    power = float(residual @ residual)
    if power == 0 or not moves.any():
        return 0.0, values
    scaled = jacobian[:, moves] / length[moves]
    # R of [J r] ends in the residuals' components along the range of J.
    factor = qr_factor(np.column_stack([scaled, residual]))
    count = min(factor.shape[0], scaled.shape[1])
    turn, size, right = np.linalg.svd(factor[:count, :-1], full_matrices=False)
    along = turn.T @ factor[:count, -1]
    kept = is_determined(size, THRESHOLDS.rank)
    if float(np.sum(along[kept] ** 2)) <= least * power:
        return 0.0, values
    step = -right.T @ np.where(kept, along / np.where(kept, size, 1.0), 0.0) / length[moves]
    best, end = 0.0, values
    for share in _SHARES:
        trial = values.copy()
        trial[moves] += share * step
        trial = project(trial, moves)
        with np.errstate(over="ignore", invalid="ignore"):  # a step too long is no gain
            gain = 1.0 - float(np.sum(residual_at(trial) ** 2)) / power
        if np.isfinite(gain) and gain > best:
            best, end = gain, trial
    return best, end
