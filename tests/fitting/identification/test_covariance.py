"""Standard errors under correlated residuals, on linear problems where the truth is known."""

import numpy as np
import pytest

from fitting.identification.assessment._covariance import correlated_covariance
from fitting.identification.assessment._toeplitz_product import ToeplitzProduct


def ar1(rng, size, rho):
    white = rng.standard_normal(size)
    out = np.empty(size)
    out[0] = white[0]
    for i in range(1, size):
        out[i] = rho * out[i - 1] + np.sqrt(1 - rho**2) * white[i]
    return out


@pytest.mark.parametrize("size", [40, 257, 1000])
def test_products_are_those_with_the_whole_covariance_matrix(size):
    rng = np.random.default_rng(size)
    matrix = rng.standard_normal((size, 3)).cumsum(axis=0)
    lag = np.arange(size)
    gamma = 0.9**lag + 0.5 * 0.3**lag
    whole = gamma[np.abs(np.subtract.outer(lag, lag))]
    found = ToeplitzProduct.of(matrix).middle(gamma)
    np.testing.assert_allclose(found, matrix.T @ whole @ matrix, rtol=1e-10)


@pytest.mark.parametrize("rho", [0.0, 0.9, 0.98])
def test_intervals_cover(rho):
    """300 replicates of a linear fit: 95 % intervals hold the truth in 90 to 98 %.

    The binomial standard deviation is 1.3 %; the plain covariance covers 17 % at rho = 0.98.
    """
    rng = np.random.default_rng(round(100 * rho))
    t = np.linspace(-1, 1, 2000)
    columns = np.stack([t**k for k in range(6)] + [np.abs(t), np.sin(9 * t)], axis=1)
    hits = []
    for _ in range(300):
        y = ar1(rng, t.size, rho)
        solved = np.linalg.lstsq(columns, y, rcond=None)[0]
        spread = correlated_covariance([y - columns @ solved], [columns], [1.0])
        hits.append(np.abs(solved) < 1.96 * spread.stderr)
    assert 0.90 <= np.mean(hits) <= 0.98


def test_weights_enter_as_a_sandwich():
    """Weights that are not those of the noise: errors still right, by the known covariance."""
    rng = np.random.default_rng(1)
    n = 4000
    columns = [np.ones((n, 1)), np.ones((n, 1))]
    series = [rng.standard_normal(n), 3.0 * rng.standard_normal(n)]
    weights = [1.0, 1.0]
    mean = float(np.mean(series))
    spread = correlated_covariance([s - mean for s in series], columns, weights)
    assert spread.stderr[0] == pytest.approx(np.sqrt(n * (1 + 9)) / (2 * n), rel=0.05)


def test_dead_columns_have_infinite_errors():
    rng = np.random.default_rng(2)
    columns = np.stack([np.ones(500), np.zeros(500)], axis=1)
    spread = correlated_covariance([rng.standard_normal(500)], [columns], [1.0])
    assert np.isfinite(spread.stderr[0]) and np.isinf(spread.stderr[1])


def test_smooth_residuals_count_as_few_samples():
    """A misfit that hardly changes from sample to sample is not white noise."""
    t = np.linspace(0, 1, 4000)
    misfit = np.sin(2 * np.pi * 3 * t) + 1e-4 * np.random.default_rng(0).standard_normal(t.size)
    spread = correlated_covariance([misfit], [np.ones((t.size, 1))], [1.0])
    assert spread.rho[0] > 0.99
    assert spread.effective < 0.02 * t.size


def slow_and_white(rng, size, rho=0.99, share=0.1):
    return np.sqrt(1.0 - share) * rng.standard_normal(size) + np.sqrt(share) * ar1(rng, size, rho)


@pytest.mark.parametrize("periods", [1, 8])
def test_intervals_cover_where_slow_noise_lies_under_white_noise(periods):
    """As above, three runs; the correlation of neighbours is 0.1, slow noise doubles the errors.

    Of a single run of one period 86 % are covered: the fit takes the slow lines whole.
    """
    rng = np.random.default_rng(periods)
    turn = np.linspace(0.0, 2.0 * np.pi * periods, 2000, endpoint=False)
    columns = np.stack([f(k * turn) for k in (1, 2, 3) for f in (np.sin, np.cos)], axis=1)
    hits = []
    for _ in range(300):
        runs = [slow_and_white(rng, turn.size) for _ in range(3)]
        solved = np.linalg.lstsq(columns, np.mean(runs, axis=0), rcond=None)[0]
        left = [y - columns @ solved for y in runs]
        each = [columns] * 3, [1.0] * 3, [1e-3] * 3, [periods] * 3
        spread = correlated_covariance(left, *each)
        hits.append(np.abs(solved) < 1.96 * spread.stderr)
    assert 0.90 <= np.mean(hits) <= 0.98


def test_what_repeats_counts_as_noise_of_the_parameters_and_what_does_not_repeat_alone_does_not():
    """A misfit at harmonics that the columns lack: errors as large as if it were noise there."""
    rng, periods, size = np.random.default_rng(3), 10, 4000
    turn = np.linspace(0.0, 2.0 * np.pi * periods, size, endpoint=False)
    columns = np.stack([np.sin(turn), np.cos(turn)], axis=1)
    noise = 0.1 * rng.standard_normal(size)
    misfit = (
        np.sign(np.sin(turn))
        - columns @ np.linalg.lstsq(columns, np.sign(np.sin(turn)), rcond=None)[0]
    )

    def stderr(series):
        solved = np.linalg.lstsq(columns, series, rcond=None)[0]
        left = [series - columns @ solved]
        return correlated_covariance(left, [columns], [1.0], [1e-3], [periods]).stderr

    alone = stderr(noise)
    np.testing.assert_allclose(alone, 0.1 * np.sqrt(2.0 / size), rtol=0.1)
    assert (stderr(noise + misfit) > 5.0 * alone).all()
