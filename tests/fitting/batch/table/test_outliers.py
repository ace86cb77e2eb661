"""Recordings that stand out: the formulas by brute force, and the claim on simulated tables."""

import batch_results as made
import numpy as np
import pytest
from scipy import stats

from fitting._multiple_tests import adjust_holm
from fitting.batch.table.statistics._outliers import compare_recordings
from fitting.batch.table.statistics._reference import Reference


def correlation(count: int, rng: np.random.Generator) -> np.ndarray:
    """A random correlation matrix."""
    a = rng.standard_normal((count, count))
    s = a @ a.T + 0.3 * np.eye(count)
    d = np.sqrt(np.diag(s))
    return s / d[:, None] / d


def table(n: int, count: int, rng: np.random.Generator, *, uneven: float, scatter: float = 1.0):
    """Parameters that scatter by 1 and have errors of 0.5, whose size varies by `uneven`.

    Returns values, covariances, and the standard deviation of each value.
    """
    between = scatter * correlation(count, rng)
    size = np.exp(uneven * rng.standard_normal(n))
    c = size[:, None, None] ** 2 * 0.25 * correlation(count, rng)
    factor = np.linalg.cholesky(between + c)
    x = np.einsum("ijk,ik->ij", factor, rng.standard_normal((n, count)))
    return x, c, np.sqrt(np.diag(between) + np.diagonal(c, axis1=1, axis2=2))


def test_holm_is_its_definition():
    p = np.array([0.04, 0.01, np.nan, 0.03, 0.2])
    # 4 x 0.01; 3 x 0.03; 2 x 0.04, but not below the one before; 0.2.
    np.testing.assert_allclose(adjust_holm(p), [0.09, 0.04, np.nan, 0.09, 0.2])
    assert adjust_holm(np.empty(0)).size == 0


def test_a_recording_is_predicted_by_the_others_alone():
    rng = np.random.default_rng(3)
    x, c, _ = table(12, 3, rng, uneven=0.0)
    c[:] = c[0]
    member = np.ones(12)
    member[[2, 7]] = 0.0
    found = Reference.of(x, c, member).predict(x, c)
    for i in range(12):
        others = x[[j for j in range(12) if member[j] and j != i]]
        size = len(others)
        covariance = np.cov(others.T) * (1 + 1 / size)
        error = x[i] - others.mean(axis=0)
        square = error @ np.linalg.solve(covariance, error)
        np.testing.assert_allclose(found.size[i], size)
        np.testing.assert_allclose(found.error[i], error)
        # The rank that is added keeps eight digits.
        np.testing.assert_allclose(found.variance[i], np.diag(covariance), rtol=1e-8)
        np.testing.assert_allclose(found.square[i], square, rtol=1e-7)


def test_the_test_of_one_parameter_is_students():
    rng = np.random.default_rng(4)
    x = rng.standard_normal((15, 1))
    found = compare_recordings(x, np.zeros((15, 1, 1)))
    assert found is not None and (found.p >= 0.05).all()
    for i in range(15):
        others = np.delete(x[:, 0], i)
        t = (x[i, 0] - others.mean()) / (others.std(ddof=1) * np.sqrt(1 + 1 / 14))
        single = 2 * stats.t.sf(abs(t), 13)
        whole = stats.f.sf(t**2, 1, 13)
        np.testing.assert_allclose(found.raw[i], min(1, 2 * min(single, whole)), rtol=1e-6)


def test_units_do_not_matter():
    rng = np.random.default_rng(5)
    x, c, _ = table(40, 4, rng, uneven=0.4)
    x[3, 1] += 9.0
    unit, zero = np.array([1e-9, 1e6, 3.0, 1.0]), np.array([1.0, 1e7, -5.0, 0.0])
    plain = compare_recordings(x, c)
    other = compare_recordings(zero + unit * x, c * np.outer(unit, unit))
    assert plain is not None and other is not None and plain.outlying[3]
    np.testing.assert_allclose(other.p, plain.p, rtol=1e-4, atol=1e-12)


def test_outliers_do_not_hide_one_another():
    rng = np.random.default_rng(6)
    x, c, sd = table(40, 5, rng, uneven=0.0)
    for i in range(12):  # three in ten, all off alike
        x[i, 2] += 12.0 * sd[i, 2]
    found = compare_recordings(x, c)
    assert found is not None
    assert found.outlying[:12].all() and not found.outlying[12:].any()


def test_a_combination_is_found_that_no_parameter_shows():
    rng = np.random.default_rng(7)
    x = rng.standard_normal((60, 1)) * np.ones(3) + 0.02 * rng.standard_normal((60, 3))
    x[9] = [1.0, -1.0, 1.0]
    found = compare_recordings(x, np.zeros((60, 3, 3)))
    assert found is not None and found.outlying[9] and np.abs(found.z[9]).max() < 2.5
    assert np.argmax(np.abs(found.given[9])) == 1 and found.given[9, 1] < -10
    assert np.isnan(np.delete(found.given, 9, axis=0)).all()


def test_a_noisy_recording_has_more_room():
    rng = np.random.default_rng(8)
    x, c, _ = table(30, 3, rng, uneven=0.0)
    x[0] += 12.0
    found = compare_recordings(x, c)
    assert found is not None and found.outlying[0]
    c[0] *= 400.0  # standard errors of 10
    found = compare_recordings(x, c)
    assert found is not None and not found.outlying[0]


def test_scatter_beyond_the_standard_errors_is_estimated():
    rng = np.random.default_rng(9)
    x, c, _ = table(4000, 3, rng, uneven=0.0)
    found = compare_recordings(x, c)
    assert found is not None
    # 1 / sqrt(2 x 4000) of the total variance 1.25, six times.
    np.testing.assert_allclose(found.scatter**2, 1.0, atol=6 * 1.25 * np.sqrt(2 / 4000))


@pytest.mark.parametrize("count", [0, 1, 9])
def test_few_recordings_are_not_compared(count):
    assert compare_recordings(made.scattered(count), np.zeros((count, 4, 4))) is None


def test_with_few_recordings_a_parameter_they_are_compared_one_by_one():
    rng = np.random.default_rng(10)
    x, c, _ = table(12, 10, rng, uneven=0.0)
    x[4, 3] += 40.0
    found = compare_recordings(x, c)
    assert found is not None and not found.together and found.outlying[4]


def test_equal_values_in_most_are_no_error():
    x = np.zeros((20, 2))
    x[:, 1] = np.arange(20)
    x[3, 0] = 1.0
    found = compare_recordings(x, np.zeros((20, 2, 2)))
    assert found is not None and np.isfinite(found.p).all()


def false_alarms(n: int, count: int, tables: int, seed: int, **more: float) -> int:
    """In how many tables without an outlier a recording is named."""
    rng, false = np.random.default_rng(seed), 0
    for _ in range(tables):
        x, c, _ = table(n, count, rng, **more)
        found = compare_recordings(x, c)
        assert found is not None
        false += bool(found.outlying.any())
    return false


def hits(n: int, count: int, tables: int, seed: int) -> int:
    """In how many tables the recording is found that has a parameter 5 deviations off."""
    rng, right = np.random.default_rng(seed), 0
    for _ in range(tables):
        x, c, sd = table(n, count, rng, uneven=0.0)
        k = rng.integers(count)
        x[0, k] = 5.0 * sd[0, k] * rng.choice([-1.0, 1.0])  # whatever its own chance was
        found = compare_recordings(x, c)
        assert found is not None
        right += bool(found.outlying[0])
    return right


def most(tables: int) -> int:
    """What 5 % of tables do not exceed but once in a thousand."""
    return int(stats.binom.ppf(0.999, tables, 0.05))


def test_false_alarms_are_as_rare_as_said_in_short():
    assert false_alarms(40, 4, 40, 11, uneven=0.0) <= most(40)
    assert hits(60, 4, 20, 14) >= 18


@pytest.mark.calibration
@pytest.mark.parametrize("scatter", [1.0, 0.0], ids=["scatter", "errors-alone"])
@pytest.mark.parametrize("uneven", [0.0, 0.7], ids=["even", "uneven"])
@pytest.mark.parametrize(("n", "count"), [(10, 4), (12, 10), (30, 10), (100, 10)])
def test_false_alarms_are_as_rare_as_said(n, count, uneven, scatter):
    assert false_alarms(n, count, 400, 12, uneven=uneven, scatter=scatter) <= most(400)


@pytest.mark.calibration
@pytest.mark.parametrize(("n", "count"), [(60, 4), (100, 10), (200, 10)])
def test_a_parameter_off_by_5_deviations_is_found(n, count):
    assert hits(n, count, 100, 13) >= 90
