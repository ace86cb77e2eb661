r"""The power of a scan not yet taken to discriminate between two hypotheses.

If `i` is true, the scan would read $y_i$. The rival `j` may be refitted on the old data and the new
scan together. What chi-square it must then lose,

$$T_{ij} = \min_\theta |y_i - y_j(\theta)|^2 + \Delta\chi^2_{old}(\theta),$$

is the scan's power for the ordered pair. To first order about its own fit, with `G` the normal
matrix of the old data and the priors and `J` the derivative on the new scan, it is
$d'(I + J G^{-1} J')^{-1} d$; `_rival_refit` finds the minimum itself.
"""

import numpy as np

from ._scan_batch import ScanPrediction
from ._thresholds import THRESHOLDS


def solve(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """With columns of equal length; directions without information stay at zero."""
    length = np.sqrt(np.maximum(np.diag(matrix), 0.0))
    informed = length > 0
    unit = np.where(informed, length, 1.0)
    scaled = matrix / unit[:, None] / unit[None, :]
    scaled[range(unit.size), range(unit.size)] = np.where(informed, 1.0 + THRESHOLDS.ridge, 1.0)
    scaled = np.nan_to_num(scaled)
    right = np.nan_to_num(right / unit)
    try:
        return np.where(informed, np.linalg.solve(scaled, right), 0.0) / unit
    except np.linalg.LinAlgError:
        return np.where(informed, np.linalg.lstsq(scaled, right, rcond=1e-12)[0], 0.0) / unit


def linear_discrimination(truth: ScanPrediction, rival: ScanPrediction) -> tuple[float, np.ndarray]:
    """The power to first order, and by how much the rival's parameters move."""
    d = truth.value - rival.value
    move = solve(rival.prior + rival.normal, rival.apply_transpose(d))
    # The cost at the solution, not a difference of large sums: rounding only adds to it.
    rest = d - rival.apply_jacobian(move)
    return float(rest @ rest + move @ rival.prior @ move), move


def buzzi_ferraris_ratio(one: ScanPrediction, other: ScanPrediction) -> float:
    """Buzzi-Ferraris's ratio: the difference against the variance of noise and of both fits."""
    d = one.value - other.value
    n = one.prior.shape[0]
    cross = one.cross_products(other)
    matrix = np.block(
        [
            [2.0 * one.prior + one.normal, -cross],
            [-cross.T, 2.0 * other.prior + other.normal],
        ]
    )
    move = solve(matrix, np.concatenate([one.apply_transpose(d), -other.apply_transpose(d)]))
    rest = d - one.apply_jacobian(move[:n]) + other.apply_jacobian(move[n:])
    cost = move[:n] @ one.prior @ move[:n] + move[n:] @ other.prior @ move[n:]
    return float(rest @ rest + 2.0 * cost) / 2.0
