"""Residuals over contact intervals: cost, gradient and Gauss-Newton matrix are those of samples."""

import jax.numpy as jnp
import numpy as np
import pytest

from fitting.identification.intervals._residual import IntervalResidual
from fitting.identification.intervals._samples import IntervalSamples
from fitting.identification.intervals._sums import IntervalSums
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._run_residual import Data
from fitting.solver._bound_transform import Bounds
from fitting.solver._least_squares import SolverOptions
from fitting.solver._levenberg_marquardt import linearise
from rapi_jax import ECDL, PI, RAPI, Drive, InverseRAPI, Recording, predict, triangle
from rapi_jax.examples import paper_device, paper_drives, paper_recording

SPREAD = np.linspace(1.9, 0.7, 10) + 1e-3 * np.pi  # of lam: some plays have crossed bands


def measured(drives, *, origin="session", noise=0.02, seed=3):
    """The paper's device, measured with these drives, with a drift and noise."""
    rng = np.random.default_rng(seed)
    responses = []
    for drive in drives:
        clean = np.asarray(predict(paper_device(), drive))
        creep = 0.3 * np.log10(1.0 + drive.session_time)
        responses.append(clean + creep + noise * rng.standard_normal(clean.size))
    return Recording.of(drives, responses, response_origin=origin)


def walks(count=2, size=900):
    """Drives that do not repeat, with unlike turning points."""
    out = []
    for seed in range(count):
        rng = np.random.default_rng(seed)
        knots = np.r_[0, np.sort(rng.choice(np.arange(30, size - 30), 6, replace=False)), size - 1]
        value = np.interp(np.arange(size), knots, rng.uniform(0.8, 5.2, knots.size))
        time = np.arange(size) * 1e-4
        out.append(Drive(time, value, 10.0 * (seed + 1), start_s=1.0 * seed))
    return out


def rapi(order=3, **changes):
    d = np.array([18.787, -1.0789, 0.010040, 2e-3, -3e-4, 2e-5, 1e-6])[:order]
    fields = dict(
        alpha=0.3127, zeta=6.137e-3, lam=SPREAD, eta=1.1137, a=0.6, b=0.12, d=d, d_0=3.0, plays=10
    )
    return ECDL(RAPI(**{**fields, **changes}))


def wave(**options):
    return triangle((10.0, 30.0), amplitude=4.5, bias=3.0, samples=1500, **options)


def swapped():
    """Response as drive: an inverse, whose origin lies inside the range and is held."""
    rng, drives, responses = np.random.default_rng(0), [], []
    for drive in paper_drives(samples=1500):
        response = np.asarray(predict(paper_device(), drive))
        drives.append(Drive(drive.time, response, drive.excitation_hz, "triangle"))
        responses.append(drive.value + 1e-3 * rng.standard_normal(drive.size))
    fields = dict(s_1=0.02, s_2=0.9, s_3=0.3, kappa=0.01, sigma=-2e-3, epsilon=0.3, eta=0.8)
    lam, g = np.linspace(1.2, 0.9, 10), (0.05, 1e-4, 1e-6, 1e-8)
    inverse = InverseRAPI(**fields, lam=lam, g=g, g_0=1.0, v_0=20.0, plays=10)
    return ECDL(inverse), Recording.of(drives, responses)


CASES = {
    "periods": lambda: (rapi(), measured(wave(periods=3)), {}),
    "drift": lambda: (rapi(), measured(wave(periods=3)), {"drift": True}),
    "own origins": lambda: (rapi(), measured(wave(), origin="run"), {"drift": True}),
    "unknown histories": lambda: (rapi(), measured(walks()), {}),
    "line": lambda: (rapi(order=1), measured(wave()), {}),
    "order 7": lambda: (rapi(order=7), measured(wave()), {}),
    "more plays": lambda: (rapi(plays=30, lam=np.linspace(2, 0.6, 30)), measured(wave()), {}),
    "polynomial held": lambda: (
        rapi(),
        measured(wave()),
        {"free": lambda e: (e.operator.lam, e.operator.alpha, e.operator.d_0)},
    ),
    "nothing linear": lambda: (rapi(), measured(wave()), {"free": lambda e: e.operator.lam}),
    "PI": lambda: (
        ECDL(PI(r=np.array([0.2, 0.7, 1.5]), p=np.array([1.0, -0.4, 2.0]), d=(15.0,), d_0=1.0)),
        measured(walks()),
        {},
    ),
    "inverse": lambda: (
        *swapped(),
        {"free": lambda e: (e.operator.lam, e.operator.s_2, e.operator.g)},
    ),
}  # fmt: skip


def posed(case):
    """The problem of a case, square roots of its weights, and its own vector."""
    ecdl, recording, options = CASES[case]()
    free = options.pop("free", lambda e: e.operator)
    problem = Problem.of(ecdl, recording, free, **options)
    use = np.random.default_rng(0).random(problem.data.use.shape) > 0.1
    weight = problem.weights(np.linspace(1.0, 0.2, len(recording.runs)), use)
    start = problem.start(ecdl, initial=0.3)
    n = problem.vector.size
    own = np.concatenate([np.where(problem.linear, 0.0, start[:n]), start[n + problem.nuisances :]])
    return problem, weight, own


def both(case):
    """The problem, and (residual, Jacobian) over intervals and over samples."""
    problem, weight, own = posed(case)
    sums = IntervalSums.of(problem, own)
    assert sums is not None
    basis = problem.linear_part(weight).basis
    samples = Data(problem.data.device(), *map(jnp.asarray, (problem.data.y, weight, basis)))
    ends, bounds = [], Bounds.of(np.ones(own.size))
    for residual, data in (
        (problem.residual(IntervalResidual), sums.data(weight)),
        (problem.residual(), samples),
    ):
        ends.append([np.asarray(a) for a in linearise(residual, bounds, jnp.asarray(own), data)])
    return problem, ends


@pytest.mark.parametrize("case", CASES)
def test_cost_gradient_and_gauss_newton_matrix_are_those_of_the_samples(case):
    problem, ((few, slopes), (error, jacobian)) = both(case)
    move = problem.free & ~problem.linear
    move = np.append(move, np.ones(jacobian.shape[1] - move.size, bool))
    slopes, jacobian = slopes * move, jacobian * move
    assert few.size < error.size / 4
    cost, made = error @ error, np.linalg.norm(jacobian, axis=0)
    np.testing.assert_allclose(few @ few, cost, rtol=1e-9)
    scale = np.sqrt(cost) * made
    np.testing.assert_allclose(slopes.T @ few, jacobian.T @ error, rtol=0, atol=1e-9 * scale.max())
    gram, expected = slopes.T @ slopes, jacobian.T @ jacobian
    np.testing.assert_allclose(gram, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    # Each parameter on its own scale too.
    moved = made > 1e-9 * made.max()
    unit = np.where(moved, made, 1.0)
    close = np.abs(gram - expected)[moved][:, moved] / np.outer(unit, unit)[moved][:, moved]
    assert close.max() < 1e-8


@pytest.mark.parametrize("case", CASES)
def test_response_and_derivatives_at_the_samples(case):
    """Spread from the intervals, they are those of the model evaluated sample by sample."""
    problem, weight, own = posed(case)
    move = np.append(
        problem.free & ~problem.linear, np.ones(own.size - problem.vector.size, dtype=bool)
    )
    found = IntervalSamples.of(problem, own, weight, move)
    assert found is not None
    expected = np.asarray(problem.residual().model(jnp.asarray(own), problem.data.device()))
    np.testing.assert_allclose(found.response, expected, rtol=0, atol=1e-11 * np.ptp(expected))
    expected = problem.differentiate(own, weight)[:, move]
    columns = (weight[:, None, :] * found.derivatives).transpose(0, 2, 1).reshape(weight.size, -1)
    size = np.abs(expected).max(axis=0)
    # A contact between two samples by no more than rounding may be told at either.
    off = np.abs(columns - expected) > 1e-9 * np.where(size > 0, size, 1.0)
    assert off.any(axis=1).sum() <= 1


def test_intervals_stand_for_samples_only_where_they_can():
    recording = measured(wave())
    bent = rapi()
    from rapi_jax.effects import Etalon
    from rapi_jax.operators import GeneralRAPI

    def of(ecdl, free=lambda e: e.operator, recording=recording):
        problem = Problem.of(ecdl, recording, free)
        return IntervalSums.of(problem, problem.start(ecdl)[: problem.own_size])

    assert of(bent) is not None
    assert of(ECDL(bent.operator, (Etalon(),))) is None
    assert of(ECDL(GeneralRAPI.of(bent.operator))) is None
    short = measured(triangle((10.0, 30.0), amplitude=4.5, bias=3.0, samples=100))
    assert of(bent, recording=short) is None
    inverse, swap = swapped()
    assert of(inverse, recording=swap) is None  # its origin moves


def test_a_play_with_a_bound_that_falls_is_left_to_the_samples():
    """`lam` below its bound of 0.05 is no start of a fit, but a user's own operator may have it."""
    problem = Problem.of(rapi(), measured(wave()), lambda e: e.operator)
    own = problem.start(rapi(lam=np.linspace(0.5, -0.1, 10)))[: problem.own_size]
    sums = IntervalSums.of(problem, own)
    assert sums is not None
    data = sums.data(problem.weights(np.ones(2)))
    assert np.isnan(np.asarray(problem.residual(IntervalResidual)(jnp.asarray(own), data))).any()


def test_without_noise_a_fit_ends_on_the_samples_with_all_digits():
    recording = paper_recording(samples=1000, noise=0.0)[0]
    problem = Problem.of(paper_device(), recording, lambda e: e.operator)
    start = problem.start(paper_device())
    start[: problem.vector.size] *= np.where(problem.linear, 1.0, 1.02)
    found = problem.solve(start, problem.weights(np.ones(4)), SolverOptions(1e-6, 1e-5, 300))
    assert np.sqrt(np.mean(found.error[problem.data.use] ** 2)) < 1e-9


def test_a_stop_by_promise_leaves_out_steps_that_change_the_cost_by_less():
    """With a `lam` for each play the cost has kinks of noise; many steps go between them."""
    start = rapi(lam=np.full(10, 1.6))
    problem = Problem.of(start, measured(wave()), lambda e: e.operator)
    weight = problem.weights(np.ones(2))
    every, few = (
        problem.solve(problem.start(start), weight, SolverOptions(1e-6, 1e-4, 300, promise))
        for promise in (0.0, 3e-9)
    )
    assert few.solver.steps < every.solver.steps
    assert few.cost < every.cost * (1.0 + 1e-8)
