"""Whether a fit has converged, and which parameters its data determine."""

from functools import partial

import numpy as np

from fitting.identification.problem._bounds import project_into_bounds
from fitting.identification.problem._problem import Problem, Solution
from fitting.solver._identifiability import undetermined_columns
from fitting.solver._least_squares import SolverOptions
from fitting.solver._refinement import try_gauss_newton_step
from fitting.solver._thresholds import THRESHOLDS


def unidentifiable(problem: Problem, solution: Solution) -> tuple[str, ...]:
    """Names of the model's parameters that the data do not determine."""
    names = np.array(problem.names)
    moving = np.zeros(names.size, dtype=bool)
    moving[: problem.vector.size] = problem.free
    if problem.own_origin:
        moving[list(names).index(problem.constant)] = False
    moving[problem.vector.size :] = True
    undetermined = names[moving][undetermined_columns(solution.jacobian[:, moving])]
    own = tuple(name for name in undetermined if name in problem.vector.names)
    if own == (problem.constant,) and len(undetermined) > 1:
        # Traded against plays that never move from their unknown start: of no consequence.
        return ()
    return own


def gain_tolerance(problem: Problem, weight: np.ndarray) -> float:
    """Share of the cost below which a further step is not taken: parameters over samples."""
    return max(problem.free_count / int((weight > 0).sum()), THRESHOLDS.remaining_gain)


def remaining_step(
    problem: Problem, solution: Solution, weight: np.ndarray
) -> tuple[float, np.ndarray]:
    """Share of the cost that a further Gauss-Newton step takes away, and where it leads."""
    kept = problem.kept.get("remaining step")
    if kept is None or kept[0] is not solution or kept[1] is not weight:
        found = _remaining_step(problem, solution, weight)
        kept = problem.kept["remaining step"] = solution, weight, found
    return kept[2]


def _remaining_step(
    problem: Problem, solution: Solution, weight: np.ndarray
) -> tuple[float, np.ndarray]:
    return try_gauss_newton_step(
        solution.values,
        (weight * solution.error).ravel(),
        solution.jacobian,
        residual_at=lambda values: weight * problem.error(values),
        project=partial(project_into_bounds, problem),
        least=THRESHOLDS.promised_gain * gain_tolerance(problem, weight),
    )


def refine(
    problem: Problem, weight: np.ndarray, solution: Solution, options: SolverOptions
) -> Solution:
    """`solution`, refitted from where a further step leads, as long as that lowers the cost."""
    for _ in range(THRESHOLDS.refinements):
        gain, values = remaining_step(problem, solution, weight)
        if gain <= gain_tolerance(problem, weight):
            break
        new = problem.solve(values, weight, options)
        if not new.cost < solution.cost:
            break
        solution = new
    return solution
