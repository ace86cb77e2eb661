"""Coefficients and tests given the variances, against formulas that need no iteration."""

import numpy as np
import pytest
from populations import covariance, draw, random_between, record
from scipy import optimize, stats

from fitting._multiple_tests import adjust_holm
from fitting.population._fit_population import fit_records
from fitting.population._outliers import leave_one_out
from fitting.population._predictive_test import moments_of_f
from fitting.population.variances._mixed_model import MixedModel
from fitting.population.variances._smooth_drift import SmoothDrift, matern


def model_of(rng, *, count=12, size=3, missing=False, own=1.0, between=None):
    """A mixed model of random estimates, at a variance that is given."""
    between = random_between(rng, size, "full") if between is None else between
    errors = np.stack([covariance(rng, size, own) for _ in range(count)])
    rows = np.c_[np.ones(count), rng.standard_normal(count)]
    design = np.stack([np.einsum("e,ab->aeb", row, np.eye(size)).reshape(size, -1) for row in rows])
    values = rng.standard_normal((count, size))
    known = np.ones((count, size), dtype=bool)
    if missing:
        known[rng.random((count, size)) < 0.25] = False
    pair = known[:, :, None] & known[:, None, :]
    units = np.eye(size)
    pairs = [(a, b) for a in range(size) for b in range(a + 1)]
    both = [np.outer(units[a], units[b]) + np.outer(units[b], units[a]) for a, b in pairs]
    tangent = np.stack([(m > 0).astype(float).ravel() for m in both], axis=1)
    return MixedModel(
        np.where(known, values, 0.0), np.where(pair, errors, 0.0), known, design,
        np.zeros(design.shape[2]), between, tangent,
    )  # fmt: skip


def stacked(model):
    """One long regression: values, design and covariance of all estimates that are known."""
    keep = model.known.ravel()
    total = np.zeros((keep.size, keep.size))
    size = model.size
    for i, own in enumerate(model.covariances):
        at = slice(i * size, (i + 1) * size)
        total[at, at] = model.between + own
    design = model.design.reshape(keep.size, -1)[keep]
    return model.values.ravel()[keep], design, total[np.ix_(keep, keep)], keep


@pytest.mark.parametrize("missing", [False, True])
def test_coefficients_are_weighted_least_squares(missing):
    model = model_of(np.random.default_rng(1), missing=missing)
    y, x, v, _ = stacked(model)
    white = np.linalg.inv(np.linalg.cholesky(v))
    expected, *_ = np.linalg.lstsq(white @ x, white @ y, rcond=None)
    assert model.coefficients == pytest.approx(expected, rel=1e-9, abs=1e-12)
    covariance = np.linalg.inv(x.T @ np.linalg.solve(v, x))
    assert model.covariance == pytest.approx(covariance, rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("missing", [False, True])
def test_the_information_is_a_trace_over_all_estimates(missing):
    model = model_of(np.random.default_rng(2), missing=missing)
    _, x, v, keep = stacked(model)
    inverse = np.linalg.inv(v)
    p = inverse - inverse @ x @ np.linalg.inv(x.T @ inverse @ x) @ x.T @ inverse
    count = len(model.values)
    slopes = [
        np.kron(np.eye(count), column.reshape(model.size, -1))[np.ix_(keep, keep)]
        for column in model.tangent.T
    ]
    expected = [[0.5 * np.trace(p @ a @ p @ b) for a in slopes] for b in slopes]
    assert model.information == pytest.approx(np.array(expected), rel=1e-9)


def test_the_correction_of_the_covariance_is_that_of_kenward_and_roger():
    """Their Eq. 5, for a covariance that is linear in its parameters, term by term."""
    model = model_of(np.random.default_rng(3), count=8, size=2)
    _, x, v, _ = stacked(model)
    inverse = np.linalg.inv(v)
    phi = np.linalg.inv(x.T @ inverse @ x)
    slopes = [np.kron(np.eye(8), column.reshape(2, 2)) for column in model.tangent.T]
    w = np.linalg.inv(model.information)
    middle = np.zeros_like(phi)
    for i, a in enumerate(slopes):
        p_i = -x.T @ inverse @ a @ inverse @ x
        for j, b in enumerate(slopes):
            p_j = -x.T @ inverse @ b @ inverse @ x
            q = x.T @ inverse @ a @ inverse @ b @ inverse @ x
            middle += w[i, j] * (q - p_i @ phi @ p_j)
    expected = phi + 2.0 * phi @ (0.5 * (middle + middle.T)) @ phi
    assert model.corrected_covariance == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("size", [1, 2, 5])
def test_the_test_is_hotellings_where_the_variance_is_wisharts(size):
    """For a Wishart variance on n degrees the two sums are known; F follows exactly."""
    n = 20.0
    factor, degrees = moments_of_f(2.0 * size / n, size * (size + 1.0) / n, size)
    assert degrees == pytest.approx(n - size + 1.0)
    assert factor == pytest.approx((n - size + 1.0) / n)
    assert moments_of_f(0.0, 0.0, size) == (1.0, np.inf)


def test_without_errors_of_their_own_estimates_are_a_plain_regression():
    """Means, drift, scatter and tests are those of ordinary least squares, exactly."""
    rng = np.random.default_rng(4)
    count, size = 20, 3
    days, warm = np.sort(rng.uniform(0, 300, count)), rng.normal(21.0, 1.0, count)
    values = rng.standard_normal((count, size)) @ rng.standard_normal((size, size)) + 5.0
    tiny = 1e-12 * np.eye(size)
    records = [
        record(y, tiny, days=t, warm=w, label=f"{i}")
        for i, (y, t, w) in enumerate(zip(values, days, warm, strict=True))
    ]
    found = fit_records(records, drift="line", structure="full", keep_outliers=True)
    x = np.c_[np.ones(count), days - days.mean(), warm - warm.mean()]
    beta, *_ = np.linalg.lstsq(x, values, rcond=None)
    left = values - x @ beta
    scatter = left.T @ left / (count - 3)
    inverse = np.linalg.inv(x.T @ x)
    for j, p in enumerate(found.parameters):
        assert p.scatter == pytest.approx(np.sqrt(scatter[j, j]), rel=1e-4)
        for effect, at in ((p.mean, 0), (p.time, 1), (p.temperature, 2)):
            assert effect.value == pytest.approx(beta[at, j], rel=1e-6)
            assert effect.stderr == pytest.approx(
                np.sqrt(inverse[at, at] * scatter[j, j]), rel=1e-4
            )
            assert effect.degrees == pytest.approx(count - 3, rel=1e-3)
        ends = (count - 3) * scatter[j, j] / stats.chi2.ppf([0.975, 0.025], count - 3)
        assert (p.scatter_low**2, p.scatter_high**2) == pytest.approx(tuple(ends), rel=1e-3)
    # Deleted residuals: the others' regression without each, and Hotelling's T^2.
    p_values = leave_one_out(found.model)
    for i in (0, 7):
        keep = np.arange(count) != i
        b, *_ = np.linalg.lstsq(x[keep], values[keep], rcond=None)
        r = values[keep] - x[keep] @ b
        n = count - 4
        s = r.T @ r / n * (1.0 + x[i] @ np.linalg.inv(x[keep].T @ x[keep]) @ x[i])
        d = values[i] - x[i] @ b
        f = d @ np.linalg.solve(s, d) * (n - size + 1) / (n * size)
        assert p_values[i] == pytest.approx(stats.f.sf(f, size, n - size + 1), rel=1e-3)


def test_the_univariate_variance_is_the_maximum_of_its_likelihood():
    """Against a one-dimensional search of the restricted likelihood as textbooks write it."""
    rng = np.random.default_rng(5)
    records = draw(rng, np.array([[0.5]]), count=15, own=1.0)
    found = fit_records(records, covariates=(), drift="line", keep_outliers=True)
    y = np.array([r.values[0] for r in records])
    v = np.array([r.stderr[0] for r in records]) ** 2

    def minus(tau2):
        w = 1.0 / (v + tau2)
        mean = np.sum(w * y) / w.sum()
        return 0.5 * (-np.log(w).sum() + np.log(w.sum()) + np.sum(w * (y - mean) ** 2))

    best = optimize.minimize_scalar(minus, bounds=(0.0, 20.0), options={"xatol": 1e-9})
    assert found.parameters[0].scatter ** 2 == pytest.approx(best.x, rel=1e-4, abs=1e-8)


def test_shrunken_estimates_lie_between_a_recording_and_the_population():
    rng = np.random.default_rng(6)
    records = draw(rng, np.array([[1.0]]), count=15, own=1.0)
    found = fit_records(records, covariates=(), keep_outliers=True)
    tau2, mean = found.parameters[0].scatter ** 2, found.parameters[0].mean.value
    for one in found.recordings:
        share = tau2 / (tau2 + one.stderr[0] ** 2)
        assert one.shrunken[0] == pytest.approx(share * one.values[0] + (1 - share) * mean)
        assert one.shrunken_stderr[0] < one.stderr[0]


def test_a_smooth_drift_elsewhere_is_kriging():
    times = np.sort(np.random.default_rng(7).uniform(-1.5, 1.5, 10))
    drift = SmoothDrift.of(times, 1.0)
    row, left = drift.at(0.3)
    k, cross = matern(times[:, None] - times, 1.0), matern(0.3 - times, 1.0)
    assert drift.values @ drift.values.T == pytest.approx(k)
    assert row @ drift.values.T == pytest.approx(cross, rel=1e-6)
    assert left == pytest.approx(1.0 - cross @ np.linalg.solve(k, cross), abs=1e-9)


def test_holm():
    adjusted = adjust_holm(np.array([0.01, 0.04, np.nan, 0.03, 0.5]))
    assert adjusted[[0, 1, 3, 4]] == pytest.approx([0.04, 0.09, 0.09, 0.5])
    assert np.isnan(adjusted[2])
