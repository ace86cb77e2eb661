"""What a change of one run would add to its response, to first order."""

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._solution import Evaluation

KINDS = ("gain", "offset", "bias", "shift", "rate")


def change_columns(
    problem: Problem, solution: Evaluation, kind: str
) -> Float[np.ndarray, "runs runs time"]:
    """Derivatives of the data of each run by a change of that run alone; second axis: which run.

    - `gain`: relative. `offset`: in the response's unit. `shift`: s by which the response is early.
      `bias`: what the drive was beyond the one written. `rate`: relative.
    """
    data = problem.data
    response = solution.error + data.y
    runs, size = response.shape
    out = np.zeros((runs, runs, size))
    for row in range(runs):
        out[row, row] = _column(problem, solution, kind, row, response[row])
    return out


def _column(
    problem: Problem, solution: Evaluation, kind: str, row: int, response: np.ndarray
) -> Float[np.ndarray, " time"]:
    data = problem.data
    there = np.flatnonzero(data.sample[row] >= 0)
    out = np.zeros(response.size)
    if there.size < 3:
        return out
    if kind == "offset":
        out[there] = 1.0
    elif kind == "gain":
        out[there] = response[there]
    elif kind == "rate":
        out[there] = _rate_column(problem, solution, row)[there]
    else:
        time = data.time[row, there]
        motion = np.gradient(response[there], time)
        if kind == "bias":
            slope = np.gradient(data.u[row, there], time)
            moves = np.abs(slope) > THRESHOLDS.changed_runs_slope * np.abs(slope).max()
            motion = np.where(moves, motion / np.where(moves, slope, 1.0), 0.0)
        out[there] = motion
    return out


def _rate_column(problem: Problem, solution: Evaluation, row: int) -> Float[np.ndarray, " time"]:
    """By the logarithm of the run's rate, through the parameters that multiply it."""
    weight = solution.weight
    jacobian = solution.jacobian.reshape(*weight.shape, -1)[row]
    scale = np.where(weight[row] > 0, weight[row], 1.0)
    total = np.zeros(weight.shape[1])
    for name in ("zeta", "kappa"):
        for place, own in enumerate(problem.vector.names):
            if own == name or own.startswith(f"{name}_"):
                total += solution.values[place] * jacobian[:, place] / scale
    return total
