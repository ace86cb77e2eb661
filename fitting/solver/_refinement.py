"""The last steps of a fit: from where a solver came to rest at a kink, on to where none is left."""

from typing import Any

import numpy as np

from fitting.identification._problem import Problem, Solution

RANK = 1e-9  # smallest over largest singular value of the column-scaled Jacobian
_GAIN = 2e-3  # of the cost, that a further step may still bring
_ROUNDS = 4


def worth(problem: Problem, weight: np.ndarray) -> float:
    """Share of the cost below which a further step is not worth taking."""
    return max(problem.free_count / int((weight > 0).sum()), _GAIN)


def remaining_step(
    problem: Problem, solution: Solution, weight: np.ndarray
) -> tuple[float, np.ndarray]:
    """Share of the cost that a Gauss-Newton step still takes away, and where it leads.

    Tried at several lengths, not promised: at a kink, where a play's contact moves to the next
    sample, the gradient jumps and promises what no step keeps.
    """
    length = np.linalg.norm(solution.jacobian, axis=0)
    free = length > 0
    residual = (weight * solution.error).ravel()
    power = float(residual @ residual)
    if power == 0 or not free.any():
        return 0.0, solution.values
    scaled = solution.jacobian[:, free] / length[free]
    full = np.linalg.lstsq(scaled, -residual, rcond=RANK)[0] / length[free]
    best, where = 0.0, solution.values
    for share in (1.0, 0.3, 0.1, 0.03, 0.01):
        values = solution.values.copy()
        values[free] += share * full
        values = _inside(problem, values, free)
        with np.errstate(over="ignore", invalid="ignore"):  # a step too long is no gain
            error = weight * problem.error(values)
            gain = 1.0 - float(np.sum(error**2)) / power
        if np.isfinite(gain) and gain > best:
            best, where = gain, values
    return best, where


def _inside(problem: Problem, values: np.ndarray, free: np.ndarray) -> np.ndarray:
    """`values` with the free ones inside their bounds, also where these move with others."""
    n = problem.vector.size
    bounds = problem.bounds(values[:n])
    coupling = np.asarray(bounds.coupling)
    bounded = bounds.bounded(values[:n])
    clipped = np.clip(bounded, np.asarray(bounds.low), np.asarray(bounds.high))
    out = values.copy()
    out[:n] = coupling @ np.where(free[:n], clipped, bounded)
    tail = slice(n + problem.nuisances, None)
    out[tail] = np.clip(values[tail], 0.0, 1.0)
    return out


def refine(problem: Problem, weight: np.ndarray, solution: Solution, **options: Any) -> Solution:
    """`solution`, fitted on from where a further step leads as long as that is worth it."""
    for _ in range(_ROUNDS):
        gain, values = remaining_step(problem, solution, weight)
        if gain <= worth(problem, weight):
            break
        new = problem.solve(values, weight, **options)
        if not new.cost < solution.cost:
            break
        solution = new
    return solution
