"""A parameter near its bound, where standard errors are wrong and the likelihood is right.

The growth of thresholds with rate, `zeta`, cannot be negative, and is small beside its standard
error. The normal approximation goes on below zero, where no device is: half of its lower tail is
impossible, and its middle is too low. The profile's interval ends at the bound, and the posterior
is the likelihood cut there; both are compared with the likelihood on a grid of values.
"""

import numpy as np
import pytest

from fitting import fit, laplace_draws, profile_likelihood, sample_posterior
from fitting.uncertainty._fitted_problem import FittedProblem
from rapi_jax import ECDL, RAPI, Recording, predict, triangle


def device(zeta):
    return ECDL(
        RAPI(alpha=0.3, zeta=zeta, lam=1.4, eta=0.8, a=0.6, b=0.1, d=(18.0, -1.0), d_0=0.0, plays=3)
    )


DRIVES = triangle((10.0, 40.0), amplitude=4.5, bias=3.0, samples=250)
TRUE, SIGMA = 2e-4, 0.2


@pytest.fixture(scope="module")
def result():
    rng = np.random.default_rng(2)
    clean = [np.asarray(predict(device(TRUE), drive)) for drive in DRIVES]
    data = Recording.of(DRIVES, [y + SIGMA * rng.standard_normal(y.size) for y in clean])
    return fit(
        device(1e-3), data, free=lambda e: e.operator.zeta, weights="uniform", starts=1,
        guess=False, hold_out=False, throw=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def grid(result):
    """Values of `zeta`, and the log-likelihood less its largest, by `predict`."""
    noise = FittedProblem.of(result).uncertainty.noise
    values = np.linspace(0.0, result["zeta"].value + 5.0 * result["zeta"].stderr, 60)
    square = np.zeros(values.size)
    for k, run in enumerate(result.recording.runs):
        gamma = noise.autocovariance(k, 2)
        assert gamma[1] == 0.0  # white noise was found
        for i, zeta in enumerate(values):
            error = np.asarray(predict(device(zeta), run.drive)) - run.response
            square[i] += error @ error / gamma[0]
    return values, -0.5 * (square - square.min())


def test_the_case_is_one(result):
    one = result["zeta"]
    assert 0.0 < one.value < 1.5 * one.stderr
    assert one.interval()[0] < 0.0  # where no device is


def test_the_profile_ends_at_the_bound(result, grid):
    values, height = grid
    one = profile_likelihood(result, ("zeta",))["zeta"]
    assert one.low == 0.0 and one.at_bound
    past = values > result["zeta"].value
    # Run noises differ a little, and the fit weighs both alike.
    end = np.interp(0.5 * 1.96**2, -height[past], values[past])
    assert one.high == pytest.approx(end, abs=0.1 * result["zeta"].stderr)


def test_laplace_draws_keep_to_the_bound(result):
    models = laplace_draws(result, draws=2000)
    zeta = models.values[:, models.vector.names.index("zeta")]
    assert zeta.min() >= 0.0 and zeta.mean() > result["zeta"].value


@pytest.mark.slow
def test_the_posterior_is_the_likelihood_on_a_grid(result, grid):
    values, height = grid
    density = np.exp(height)
    total = np.concatenate([[0.0], np.cumsum((density[1:] + density[:-1]) / 2.0)])
    exact = np.interp([0.025, 0.5, 0.975], total / total[-1], values)
    draws = np.asarray(sample_posterior(result).posterior["zeta"]).ravel()
    assert draws.min() > 0.0
    found = np.quantile(draws, [0.025, 0.5, 0.975])
    # 5 standard errors of a quantile from a thousand effective draws, here in ranks.
    share = np.interp(found, values, total / total[-1])
    ranks = np.array([0.025, 0.5, 0.975])
    assert (np.abs(share - ranks) < 5.0 * np.sqrt(ranks * (1 - ranks) / 1000)).all()
    assert exact[1] > result["zeta"].value  # the normal law's middle is too low
