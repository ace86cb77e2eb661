"""Bounds of a problem's vector, and values put inside them."""

from typing import TYPE_CHECKING

import numpy as np

from fitting.solver._bound_transform import Bounds

if TYPE_CHECKING:
    from ._problem import Problem


def moving_bounds(problem: "Problem") -> dict[tuple[int, int], float]:
    """Places of free parameters whose bounds move with another's, by the operator."""
    names = problem.vector.names
    slopes = problem.ecdl.operator.couplings(list(problem.data.u_pp), list(problem.data.freq))
    places = {(names.index(a), names.index(b)): slope for (a, b), slope in slopes.items()}
    free = problem.free
    return {(i, j): slope for (i, j), slope in places.items() if free[i] and free[j]}


def bounds_of(problem: "Problem", start: np.ndarray) -> Bounds:
    """Bounds of the vector without its offsets, for a fit from `start`."""
    low = np.array(problem.vector.spread(lambda p: p.bounds[0]))
    high = np.array(problem.vector.spread(lambda p: p.bounds[1]))
    coupling = np.eye(start.size)
    for (moved, by), slope in moving_bounds(problem).items():
        coupling[moved, by] = slope
    extra = start.size - problem.vector.size
    low = np.concatenate([low, np.zeros(extra)])
    high = np.concatenate([high, np.ones(extra)])
    return Bounds.of(start, low, high, coupling)


def project_into_bounds(problem: "Problem", values: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """`values` with those that move inside their bounds, also where these move with others."""
    n = problem.vector.size
    bounds = bounds_of(problem, values[:n])
    coupling = np.asarray(bounds.coupling)
    bounded = bounds.bounded(values[:n])
    clipped = np.clip(bounded, np.asarray(bounds.low), np.asarray(bounds.high))
    out = values.copy()
    out[:n] = coupling @ np.where(moves[:n], clipped, bounded)
    tail = slice(n + problem.nuisances, None)
    out[tail] = np.clip(values[tail], 0.0, 1.0)
    return out
