"""The likelihood under correlated noise, against dense matrices."""

import jax.numpy as jnp
import linear_devices as linear
import numpy as np
import pytest
from scipy.linalg import toeplitz

from fitting.uncertainty._fitted_problem import FittedProblem
from fitting.uncertainty.posterior._log_density import SampleMisfit
from fitting.uncertainty.posterior._noise_precision import NoisePrecision
from fitting.uncertainty.posterior._pose import Posed


def test_the_precision_of_stationary_noise_is_the_dense_inverse():
    rng = np.random.default_rng(0)
    use = np.zeros((2, 60), dtype=bool)
    use[0, 5:55], use[1, :37] = True, True
    gammas = [0.3 * 0.9 ** np.arange(50) + 0.1 * (np.arange(50) == 0), 0.2 * (np.arange(37) == 0)]
    error = rng.standard_normal(use.shape)
    dense = sum(
        error[k, use[k]] @ np.linalg.solve(toeplitz(gamma), error[k, use[k]])
        for k, gamma in enumerate(gammas)
    )
    found = NoisePrecision.of(use, gammas).square(jnp.asarray(error))
    assert float(found) == pytest.approx(dense, rel=1e-10)


def test_generalised_least_squares_of_the_linear_part():
    result = linear.fitted(linear.recording(0, linear.ar1(0.9)))
    fitted = FittedProblem.of(result)
    noise = fitted.uncertainty.noise
    posed = Posed.of(fitted)
    assert isinstance(posed.density.misfit, SampleMisfit)  # relaxations were found
    p = np.array([2.1, 0.9, 0.6])  # away from the optimum
    problem = fitted.problem
    own = fitted.solution.own.copy()
    own[problem.vector.slice("p")] = p
    own = jnp.asarray(own)
    square, moment, total = 0.0, 0.0, 0.0
    for k, (drive, run) in enumerate(zip(linear.drives(), result.recording.runs, strict=True)):
        precision = np.linalg.inv(toeplitz(noise.autocovariance(k, drive.size)))
        every = linear.design(drive.value)
        left, x = run.response - every[:, :3] @ p, every[:, 3:]
        square, moment = square + x.T @ precision @ x, moment + x.T @ precision @ left
        total += left @ precision @ left
    exact = np.linalg.solve(square, moment)
    best = dict(zip(posed.places, np.asarray(posed.samples.best_linear(own)), strict=True))
    found = [best[problem.names.index(name)] for name in ("d_1", "d_2", "d_0")]
    assert np.allclose(found, exact, rtol=1e-8)
    assert float(posed.samples(own)) == pytest.approx(total - moment @ exact, rel=1e-8)
    assert np.allclose(posed.root @ posed.root.T, np.asarray(posed.samples.covariance))
