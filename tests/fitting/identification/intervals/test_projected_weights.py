"""Weights of plays, one each, are solved for at every step: variable projection."""

from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.intervals._residual import IntervalResidual
from fitting.identification.intervals._sums import IntervalSums
from fitting.identification.problem._bounds import bounds_of
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._run_residual import Data
from fitting.solver._bound_transform import Bounds
from fitting.solver._least_squares import SolverOptions, least_squares
from fitting.solver._levenberg_marquardt import evaluate, linearise
from rapi_jax import ECDL, PI, RAPI, Recording, predict, triangle
from rapi_jax.examples import paper_device

THRESHOLDS = np.array([0.15, 0.4, 0.9, 1.6])
WEIGHTS = np.array([2.0, 1.5, -0.5, 1.2])


def pi(r: Any = THRESHOLDS, p: Any = WEIGHTS):
    return ECDL(PI(r=np.asarray(r), p=np.asarray(p), d=(15.0, 0.2), d_0=1.0))


def posed(start=None, **options):
    drives = triangle((10.0, 30.0), amplitude=4.5, bias=3.0, samples=1500)
    rng = np.random.default_rng(1)
    clean = [np.asarray(predict(pi(), drive)) for drive in drives]
    recording = Recording.of(drives, [y + 0.02 * rng.standard_normal(y.size) for y in clean])
    problem = Problem.of(start or pi(), recording, lambda e: e.operator, **options)
    return problem, problem.weights(np.array([1.0, 0.3]))


def compressed(problem, weight):
    """The problem's own vector, what of it moves, and its sums over intervals."""
    own, move = problem.own_vector(problem.start(problem.ecdl))
    sums = IntervalSums.of(problem, own)
    assert sums is not None
    return own, move, sums.data(weight)


def over_samples(problem, weight, own):
    """Weighted residuals of all samples less what is linear, with plays' weights as in `own`."""
    basis = problem.linear_part(weight).basis
    data = Data(problem.data.device(), *map(jnp.asarray, (problem.data.y, weight, basis)))
    return linearise(problem.residual(), Bounds.of(np.ones(own.size)), jnp.asarray(own), data)


def test_the_cost_is_the_least_over_all_weights():
    """By a linear least-squares problem of samples, with the columns of plays as predicted."""
    r = [0.2, 0.5, 1.1, 1.3]
    problem, weight = posed(pi(r, [0.1, 7.0, 3.0, -9.0]))
    own, _, data = compressed(problem, weight)
    residual = problem.interval_residual
    rows, values = residual.solved(jnp.asarray(own), data)
    tall, target = [], []
    for drive, y, scale in zip(problem.recording.drives, problem.data.y, weight, strict=True):
        one = [PI(r=r, p=row, d=(0.0,), d_0=0.0) for row in np.eye(4)]
        columns = [*(drive.value**k for k in range(3)), *(predict(ECDL(o), drive) for o in one)]
        tall.append(scale[: drive.size, None] * np.stack(columns, axis=1))
        target.append(scale[: drive.size] * y[: drive.size])
    found, cost = np.linalg.lstsq(np.concatenate(tall), np.concatenate(target), rcond=None)[:2]
    np.testing.assert_allclose(rows @ rows, cost[0], rtol=1e-9)
    np.testing.assert_allclose(values[problem.vector.slice("p")], found[3:], rtol=1e-7)


def test_gradient_and_gauss_newton_matrix_are_those_at_the_best_weights():
    problem, weight = posed(pi([0.2, 0.5, 1.1, 1.3], [0.1, 7.0, 3.0, -9.0]))
    own, _, data = compressed(problem, weight)
    bounds = Bounds.of(np.ones(own.size))
    x, rows, slopes, values, _ = evaluate(problem.interval_residual, bounds, jnp.asarray(own), data)
    np.testing.assert_array_equal(x, values)  # coordinates follow the weights
    error, jacobian = over_samples(problem, weight, np.asarray(values))
    move = problem.free & ~problem.linear
    slopes, jacobian = np.asarray(slopes)[:, move], np.asarray(jacobian)[:, move]
    scale = np.linalg.norm(jacobian, axis=0)
    gradient, expected = (j.T @ np.asarray(e) for j, e in ((slopes, rows), (jacobian, error)))
    size = np.linalg.norm(error) * scale
    np.testing.assert_allclose(gradient / size, expected / size, atol=1e-9)
    weights = [
        i for i, name in enumerate(np.array(problem.names)[: own.size][move]) if "p_" in name
    ]
    assert np.abs(gradient / size)[weights].max() < 1e-9
    unit = np.outer(scale, scale)
    np.testing.assert_allclose(slopes.T @ slopes / unit, jacobian.T @ jacobian / unit, atol=1e-8)


def test_the_weights_started_from_do_not_matter():
    ends = []
    for p in ([0.1, 0.1, 0.1, 0.1], [30.0, -20.0, 5.0, -1.0]):
        start = pi(1.1 * THRESHOLDS, p)
        problem, weight = posed(start)
        solution = problem.solve(problem.start(start), weight, SolverOptions(max_steps=100))
        ends.append(solution.solver)
    first, second = ends
    assert first.converged and second.converged
    np.testing.assert_allclose(first.trace[0][1], second.trace[0][1], rtol=1e-9)  # at the start
    np.testing.assert_allclose(first.cost, second.cost, rtol=1e-12)
    np.testing.assert_allclose(first.values, second.values, rtol=1e-9)


def descents(factor):
    """Where the whole problem and the projected one end, from thresholds times `factor`."""
    start = pi(factor * THRESHOLDS, np.full(4, 1.0))
    problem, weight = posed(start)
    own, move, data = compressed(problem, weight)
    options = SolverOptions(max_steps=2000)
    found = [
        least_squares(
            residual, own, data, bounds=bounds_of(problem, own), free=move, options=options
        )
        for residual in (problem.residual(IntervalResidual), problem.interval_residual)
    ]
    return found, move


def test_the_ends_are_those_of_the_whole_problem_in_fewer_steps():
    """The steps of three starts together: rounding adds one to a descent or takes one away."""
    steps = np.zeros(2)
    for factor in (0.8, 0.9, 1.1):
        (whole, projected), move = descents(factor)
        assert projected.converged and whole.converged
        np.testing.assert_allclose(projected.cost, whole.cost, rtol=1e-10)
        np.testing.assert_allclose(projected.values, whole.values, rtol=1e-5)
        np.testing.assert_allclose(
            projected.jacobian, whole.jacobian, atol=1e-4 * np.abs(whole.jacobian).max()
        )
        np.testing.assert_allclose(projected.stderr[move], whole.stderr[move], rtol=1e-4)
        steps += whole.steps, projected.steps
    assert steps[1] < steps[0]


def test_plays_that_act_alike_share_their_weight():
    start = pi([0.4, 0.4, 0.9, 1.6], np.ones(4))
    problem, weight = posed(start)
    own, _, data = compressed(problem, weight)
    rows, values = problem.interval_residual.solved(jnp.asarray(own), data)
    p = np.asarray(values)[problem.vector.slice("p")]
    np.testing.assert_allclose(p[0], p[1], rtol=1e-6)
    three = pi([0.4, 0.9, 1.6], np.ones(3))
    problem, weight = posed(three)
    own, _, data = compressed(problem, weight)
    fewer, _ = problem.interval_residual.solved(jnp.asarray(own), data)
    np.testing.assert_allclose(rows @ rows, fewer @ fewer, rtol=1e-9)


def test_a_play_wider_than_the_drive_gets_no_weight():
    start = pi([0.4, 0.9, 1.6, 9.0], np.ones(4))
    problem, weight = posed(start)
    own, _, data = compressed(problem, weight)
    _, values = problem.interval_residual.solved(jnp.asarray(own), data)
    p = np.asarray(values)[problem.vector.slice("p")]
    assert np.isfinite(p).all() and abs(p[3]) < 1e-6


def rapi(**changes):
    operator = paper_device().operator
    names = ("alpha", "zeta", "lam", "eta", "a", "b", "d", "d_0")
    return ECDL(RAPI(**{name: getattr(operator, name) for name in names} | changes, plays=10))


@pytest.mark.parametrize(
    ("model", "free", "projected"),
    [
        (pi(), lambda e: e.operator, True),
        (pi(), lambda e: e.operator.p, True),
        (pi(), lambda e: e.operator.r, False),  # weights are held
        (pi([0.4], [1.0]), lambda e: e.operator, False),  # one number
        (rapi(), lambda e: e.operator, False),
        (rapi(a=np.full(10, 0.6)), lambda e: e.operator, False),  # positive
    ],
)
def test_weights_are_projected_where_each_moves_without_bounds(model, free, projected):
    drives = triangle((10.0,), amplitude=4.5, bias=3.0, samples=500)
    recording = Recording.of(drives, [np.asarray(predict(model, drive)) for drive in drives])
    assert Problem.of(model, recording, free).interval_residual.projects is projected
