"""The minimum of a quadratic model between bounds, by principal pivoting in blocks.

Where a step would pass a bound and is only cut there, the other unknowns still move as if it had
gone all the way: next to a bound such steps raise the cost, whatever their length. Here the others
are solved for beside what stands at its bound (Judice and Pires, Comput. Oper. Res. 21, 587).
"""

import numpy as np
from jaxtyping import Float

_EXCHANGES = 10  # rounds in which a bound may be left again; after them bounds only gain unknowns


def bounded_step(
    matrix: Float[np.ndarray, "unknowns unknowns"],
    gradient: Float[np.ndarray, " unknowns"],
    least: Float[np.ndarray, " unknowns"],
    most: Float[np.ndarray, " unknowns"],
) -> Float[np.ndarray, " unknowns"]:
    """The `step` between `least` <= 0 and `most` >= 0 of least step' matrix step / 2 + gradient'
    step; `matrix` is positive definite.
    """
    step = -np.linalg.solve(matrix, gradient)
    at_bound = (step < least) | (step > most)
    if not at_bound.any():
        return step
    for round in range(_EXCHANGES + gradient.size):
        step = np.where(at_bound, np.clip(step, least, most), 0.0)
        free = ~at_bound
        pull = gradient + matrix @ step
        step[free] = -np.linalg.solve(matrix[np.ix_(free, free)], pull[free])
        slope = gradient + matrix @ step
        inwards = np.where(step <= least, slope < 0.0, slope > 0.0)
        leaving = at_bound & inwards & (least < most) if round < _EXCHANGES else False
        beyond = free & ((step < least) | (step > most))
        if not beyond.any() and not np.any(leaving):
            break
        at_bound = (at_bound & ~np.asarray(leaving)) | beyond
    return np.clip(step, least, most)
