"""Losses against their definitions, and residuals drawn near for the checks."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.stats import norm
from scipy.stats import t as student_t

from fitting.identification.robust._despike import despike
from fitting.identification.robust._loss import Huber, Student, loss_of

Z = np.linspace(-12.0, 12.0, 481)


def test_hubers_psi_is_cut_off():
    np.testing.assert_allclose(Z * Huber(1.345).weight(Z), np.clip(Z, -1.345, 1.345), atol=1e-14)


def test_students_psi_is_that_of_the_likelihood():
    degrees, step = 4.0, 1e-5
    rise = -student_t.logpdf(Z + step, degrees) + student_t.logpdf(Z - step, degrees)
    likelihood = rise / (2.0 * step) * degrees / (degrees + 1.0)  # a slope of 1 at 0
    np.testing.assert_allclose(Z * Student(degrees).weight(Z), likelihood, atol=1e-9)


@pytest.mark.parametrize("loss", [Huber(1.345), Student(4.0)])
def test_slope_is_the_derivative_of_psi(loss):
    z, step = Z[np.abs(np.abs(Z) - 1.345) > 0.01], 1e-6
    rise = (z + step) * loss.weight(z + step) - (z - step) * loss.weight(z - step)
    np.testing.assert_allclose(loss.slope(z), rise / (2.0 * step), atol=1e-8)


@pytest.mark.parametrize("loss", [Huber(1.345), Student(4.0)])
def test_rms_under_normal_noise(loss):
    def square(z):
        return float((z * loss.weight(np.array(z))) ** 2) * norm.pdf(z)

    assert loss.normal_rms == pytest.approx(np.sqrt(2.0 * quad(square, 0.0, 8.0)[0]), rel=1e-5)


def test_hubers_efficiency_is_95_percent():
    loss = Huber(1.345)
    slope = quad(
        lambda z: float(loss.slope(np.array(z))) * norm.pdf(z), -8, 8, points=[-1.345, 1.345]
    )
    assert slope[0] ** 2 / loss.normal_rms**2 == pytest.approx(0.95, abs=1e-3)


def test_an_unknown_loss_is_refused():
    assert loss_of("squares") is None
    with pytest.raises(ValueError, match='"squares", "huber" or "student", but is \'cauchy\''):
        loss_of("cauchy")


def test_despiking_keeps_jumps_and_slopes():
    rng = np.random.default_rng(0)
    clean = np.linspace(0.0, 3.0, 400)[None, :] + np.where(np.arange(400) < 200, 0.0, 5.0)[None, :]
    error = clean + 0.02 * rng.standard_normal(clean.shape)
    spiked = error.copy()
    spiked[0, 20:380:20] += 50.0
    found = despike(spiked, np.ones(clean.shape, dtype=bool))
    assert np.abs(found - clean).max() < 0.2
    assert found[0, 200] - found[0, 199] == pytest.approx(5.0, abs=0.2)
    assert (despike(np.zeros((1, 50)), np.ones((1, 50), dtype=bool)) == 0).all()
