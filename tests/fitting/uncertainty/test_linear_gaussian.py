"""A linear model under white noise: profile, Laplace and NUTS are the closed form."""

import linear_devices as linear
import numpy as np
import pytest

from fitting import laplace_draws, profile_likelihood, sample_posterior
from fitting.uncertainty._fitted_problem import FittedProblem


@pytest.fixture(scope="module")
def result():
    return linear.fitted(linear.recording(3))


@pytest.fixture(scope="module")
def closed(result):
    """Estimates and covariance by NumPy, with the variance of the residuals."""
    x = np.concatenate([linear.design(d.value) for d in linear.drives()])
    y = np.concatenate([run.response for run in result.recording.runs])
    beta, rss = np.linalg.lstsq(x, y)[:2]
    return beta, float(rss[0]) / (y.size - beta.size) * np.linalg.inv(x.T @ x)


def test_standard_errors_are_those_of_the_closed_form(result, closed):
    beta, covariance = closed
    found = [result[name] for name in linear.NAMES]
    assert np.allclose([p.value for p in found], beta, rtol=1e-6)
    # The noise model knows each run's variance, and takes it from bins of lines.
    assert np.allclose([p.stderr for p in found], np.sqrt(np.diag(covariance)), rtol=0.02)


def test_profile_ends_are_those_of_the_closed_form(result, closed):
    beta, _ = closed
    stderr = np.array([result[name].stderr for name in linear.NAMES])
    found = profile_likelihood(result, ("p_1", "p_3", "d_2"))
    for name, one in found.items():
        at = linear.NAMES.index(name)
        ends = (np.array([one.low, one.high]) - beta[at]) / stderr[at]
        assert ends == pytest.approx([-1.96, 1.96], abs=0.03)  # the search ends within 0.02
        assert not one.at_bound and one.remark == "" and one.level == 0.95
    half = profile_likelihood(result, ("p_1",), level=0.5)["p_1"]
    assert (half.high - beta[0]) / stderr[0] == pytest.approx(0.6745, abs=0.03)


def test_laplace_draws_have_the_closed_covariance(result, closed):
    beta, covariance = closed
    models = laplace_draws(result, draws=20_000)
    places = [models.vector.names.index(name) for name in linear.NAMES]
    some = (models.values[:, places] - beta) / np.sqrt(np.diag(covariance))
    assert np.abs(some.mean(axis=0)).max() < 0.04  # 5 / sqrt(20 000)
    unit = np.sqrt(np.diag(covariance))
    assert np.allclose(np.corrcoef(some.T), covariance / np.outer(unit, unit), atol=0.02)
    held = [i for i in range(models.values.shape[1]) if i not in places]
    assert (np.ptp(models.values[:, held], axis=0) == 0).all()


def test_the_posterior_is_normal_with_the_closed_moments(result, closed):
    beta, covariance = closed
    fitted = FittedProblem.of(result)
    variances = [fitted.uncertainty.noise.autocovariance(run, 2) for run in (0, 1)]
    assert all(gamma[1] == 0 for gamma in variances)  # white noise was found
    posterior = sample_posterior(result)
    assert set(linear.NAMES) == set(posterior.posterior.data_vars)
    draws = np.stack([np.asarray(posterior.posterior[name]).ravel() for name in linear.NAMES])
    assert draws.dtype == np.float64 and draws.shape == (6, 4000)
    # By noise of each run: a weighted closed form.
    precision, moment = 0.0, 0.0
    for drive, run, gamma in zip(linear.drives(), result.recording.runs, variances, strict=True):
        x = linear.design(drive.value)
        precision, moment = precision + x.T @ x / gamma[0], moment + x.T @ run.response / gamma[0]
    exact = np.linalg.inv(precision)
    unit = np.sqrt(np.diag(exact))
    off = (draws.mean(axis=1) - exact @ moment) / unit
    assert np.abs(off).max() < 5.0 / np.sqrt(1000)  # at least a thousand effective draws
    assert np.allclose(draws.std(axis=1) / unit, 1.0, atol=5.0 / np.sqrt(2 * 1000))
    assert np.allclose(np.corrcoef(draws), exact / np.outer(unit, unit), atol=0.15)
