"""Quadratic models between bounds, beside SciPy's bounded least squares."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from fitting.solver._bounded_step import bounded_step


def random_model(seed, size):
    """A least-squares problem of that many unknowns, and bounds of which many are active."""
    rng = np.random.default_rng(seed)
    jacobian = rng.normal(size=(3 * size, size)) @ np.diag(10.0 ** rng.uniform(-1, 1, size))
    if seed % 3 == 0:  # two columns nearly parallel
        jacobian[:, -1] = jacobian[:, 0] + 1e-3 * rng.normal(size=3 * size)
    residual = 5.0 * rng.normal(size=3 * size)
    least, most = -rng.exponential(0.3, size), rng.exponential(0.3, size)
    least[rng.random(size) < 0.2], most[rng.random(size) < 0.2] = -np.inf, np.inf
    least[rng.random(size) < 0.2] = 0.0  # already at a bound
    return jacobian, residual, least, most


@pytest.mark.parametrize("seed", range(60))
def test_it_is_the_minimum_between_bounds(seed):
    jacobian, residual, least, most = random_model(seed, 2 + seed % 12)
    step = bounded_step(jacobian.T @ jacobian, jacobian.T @ residual, least, most)
    expected = lsq_linear(jacobian, -residual, (least, most), method="bvls", tol=1e-14)
    assert (step >= least).all() and (step <= most).all()
    cost = np.sum((jacobian @ step + residual) ** 2)
    assert cost == pytest.approx(2.0 * expected.cost, rel=1e-7)
    assert step == pytest.approx(expected.x, abs=1e-5)


def test_without_an_active_bound_it_is_the_solution():
    jacobian, residual, _, _ = random_model(1, 5)
    matrix, gradient = jacobian.T @ jacobian, jacobian.T @ residual
    unbounded = np.full(5, np.inf)
    step = bounded_step(matrix, gradient, -unbounded, unbounded)
    assert step == pytest.approx(-np.linalg.solve(matrix, gradient))


def test_an_unknown_without_room_stays_and_the_others_are_solved_for_beside_it():
    matrix, gradient = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-3.0, 0.0])
    step = bounded_step(matrix, gradient, np.array([0.0, -9.0]), np.array([0.0, 9.0]))
    assert step.tolist() == [0.0, 0.0]
    step = bounded_step(matrix, gradient, np.array([0.0, -9.0]), np.array([0.5, 9.0]))
    assert step == pytest.approx([0.5, -0.25])
