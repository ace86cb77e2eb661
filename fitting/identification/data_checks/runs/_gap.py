"""What a model leaves of the data beyond the noise, as sums of squares."""

import numpy as np

from fitting.identification.assessment._noise import measure_noise
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._solution import Evaluation


def squared_gap_and_noise(
    problem: Problem, weight: np.ndarray, solution: Evaluation
) -> tuple[float, float]:
    """Weighted sums of squares beyond the noise, and of the noise."""
    whole = float(np.sum((weight * solution.error) ** 2))
    noise = float(np.sum(weight**2 * measure_noise(problem, solution.error).rms[:, None] ** 2))
    return max(whole - noise, 0.0), noise


def squared_gap(problem: Problem, weight: np.ndarray, solution: Evaluation) -> float:
    """Weighted sum of squares beyond the noise."""
    return squared_gap_and_noise(problem, weight, solution)[0]
