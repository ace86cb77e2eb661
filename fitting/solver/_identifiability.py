"""Which parameters the data cannot fix."""

import numpy as np

from fitting.identification._problem import Problem, Solution

from ._refinement import RANK


def unidentifiable(problem: Problem, solution: Solution) -> tuple[str, ...]:
    """Parameters that the data cannot fix: in a null direction of the scaled Jacobian."""
    names = np.array(problem.names)
    moving = np.zeros(names.size, dtype=bool)
    moving[: problem.vector.size] = problem.free
    if problem.own_origin:
        moving[list(names).index(problem.constant)] = False
    moving[problem.vector.size :] = True
    columns = solution.jacobian[:, moving]
    length = np.linalg.norm(columns, axis=0)
    dead = length <= 1e-12 * max(length.max(initial=0.0), 1e-300)
    scaled = columns / np.where(dead, 1.0, length)
    triangle = np.linalg.qr(scaled, mode="r")
    _, size, right = np.linalg.svd(triangle)
    null = right[: size.size][size <= RANK * max(size.max(initial=0.0), 1e-300)]
    loose = dead | (np.abs(null) > 0.05).any(axis=0)
    own = names[moving][loose]
    mine = tuple(name for name in own if name in problem.vector.names)
    if mine == (problem.constant,) and len(own) > 1:
        # Traded against plays that never move from their unknown start: of no consequence.
        return ()
    return mine
