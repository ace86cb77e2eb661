"""What is said of where the starts of a fit ended: of costs and of responses."""

import numpy as np
import pytest

from fitting.identification.assessment._ends import describe_starts, rank_ends
from fitting.identification.problem._problem import Problem, Solution
from fitting.solver._optimum import LeastSquares
from rapi_jax.examples import NOISE, paper_device, paper_recording


@pytest.fixture(scope="module")
def problem():
    recording, _ = paper_recording(samples=200, periods=2, noise=NOISE)
    return Problem.of(paper_device(), recording, lambda e: e.operator)


def end(problem, error):
    """An end with these residuals at unit weights, whatever its parameters."""
    none = np.zeros(0)
    flags = np.zeros(0, dtype=bool)
    square = np.zeros((0, 0))
    solver = LeastSquares(none, error.ravel(), square, square, flags, flags, 0.0, 5, True, "", ())
    found = Solution(problem, none, flags, np.ones_like(error), solver)
    found.__dict__["_solved"] = none, error  # what the parameters would lead to
    return found


def beside(error, share, rng):
    """Residuals of another response: the rms of the difference is `share` of theirs, orthogonal."""
    other = rng.standard_normal(error.shape)
    other -= error * np.sum(other * error) / np.sum(error**2)
    return error + share * other * np.linalg.norm(error) / np.linalg.norm(other)


@pytest.fixture(scope="module")
def ranked(problem):
    rng = np.random.default_rng(0)
    smooth = np.sin(np.linspace(0.0, 40.0, problem.data.y.size)).reshape(problem.data.y.shape)
    # By Pythagoras the cost of `beside(e, s)` is 1 + s^2 of that of `e`.
    shares = {"best": 0.0, "same": 0.02, "near": 0.3, "far": 1.0, "farther": 5.0}
    ends = [(name, end(problem, beside(smooth, share, rng))) for name, share in shares.items()]
    return rank_ends(problem, np.ones_like(problem.data.y), ends, nearby=2)[1]


def test_equal_costs_are_told_from_responses_that_are_nearly_equal(ranked):
    assert [start.describe() for start in ranked] == [
        "lowest cost",
        "same cost and response",
        "nearly the same response, cost 9 % higher",
        "another optimum, cost 2 times as high",
        "another optimum, cost 26 times as high",
    ]
    assert [start.excess for start in ranked] == pytest.approx([0, 4e-4, 0.09, 1, 25], rel=1e-6)
    assert [start.agrees for start in ranked] == [True, True, True, False, False]


def test_starts_are_counted_by_where_they_began_and_ended(ranked):
    assert [start.nearby for start in ranked] == [False, False, False, True, True]
    assert describe_starts(ranked) == (
        "3 from first guesses, 2 from values beside an end found before. 2 of 5 reached the lowest "
        "cost, to 0.2 %; 1 responds nearly as it does at a higher cost; 2 ended in another optimum."
    )
    few = "2 from first guesses. 2 of 2 reached the lowest cost, to 0.2 %."
    assert describe_starts(ranked[:2]) == few


def test_another_response_of_the_same_cost_is_another_optimum(problem):
    error = np.random.default_rng(1).standard_normal(problem.data.y.shape)
    ends = [("one", end(problem, error)), ("other", end(problem, -error))]
    _, (_, other) = rank_ends(problem, np.ones_like(problem.data.y), ends)
    assert other.describe() == "another optimum, same cost"


def test_residuals_of_rounding_are_of_the_same_cost(problem):
    error = 1e-12 * np.random.default_rng(2).standard_normal(problem.data.y.shape)
    ends = [("one", end(problem, error)), ("other", end(problem, 7.0 * error))]
    _, (_, other) = rank_ends(problem, np.ones_like(problem.data.y), ends)
    assert other.describe() == "same cost and response"
