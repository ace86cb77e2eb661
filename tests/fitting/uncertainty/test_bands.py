"""Bands on predictions, scans and distances, against closed forms and single models."""

import json

import equinox as eqx
import jax.numpy as jnp
import linear_devices as linear
import numpy as np
import pytest

from fitting import (
    ModelDraws,
    distance_band,
    laplace_draws,
    nonlinearity_band,
    prediction_band,
)
from fitting._json import json_text
from fitting.commands.shared._nonlinearity_band import _held_out_error
from fitting.uncertainty.bands._draws import laplace_draws_of
from rapi_jax import Identified, ModelError, Run, compensate, linear_scan, linearity, predict
from rapi_jax.ranging.budget import Conditions, interpolation_spread


@pytest.fixture(scope="module")
def result():
    return linear.fitted(linear.recording(3))


@pytest.fixture(scope="module")
def covariance(result):
    stderr = np.array([result[name].stderr for name in result.names])
    order = [result.names.index(name) for name in linear.NAMES]
    return (np.outer(stderr, stderr) * result.correlation)[np.ix_(order, order)]


DRIVE = linear.drives(120)[1]


def test_prediction_band_of_a_linear_model(result, covariance):
    band = prediction_band(result, DRIVE, draws=4000)
    x = linear.design(DRIVE.value)
    exact = np.sqrt(np.einsum("ti,ij,tj->t", x, covariance, x))
    assert np.allclose(band.predicted, np.asarray(predict(result.ecdl, DRIVE)), atol=1e-9)
    assert np.allclose(band.stderr, exact, rtol=0.06)  # 5 standard errors
    half = (band.high - band.low) / 2.0
    assert np.allclose(half, 1.96 * exact, rtol=0.1)
    # Wider, but no wider than without any dependence of samples (Scheffe's, 6 parameters).
    factor = (band.all_high - band.predicted) / band.stderr
    assert np.ptp(factor) < 1e-9 and 2.2 < factor[0] < np.sqrt(12.59)
    assert band.holds(band.predicted) and not band.holds(band.predicted + 1.0)


def test_a_band_of_one_model_is_that_model(result):
    values = laplace_draws(result, draws=1, seed=5).values
    one = ModelDraws(result.ecdl, values, "laplace")
    model = one.vector.put(result.ecdl, jnp.asarray(values[0]))
    response = np.asarray(predict(model, DRIVE))
    assert np.allclose(prediction_band(one, DRIVE).low, response, atol=1e-9)
    turning = linearity(Run(DRIVE, np.asarray(predict(result.ecdl, DRIVE)))).turning
    scan = linearity(Run(DRIVE, response), turning=turning)
    straight = nonlinearity_band(one, DRIVE)
    assert (straight.up[0], straight.down[0]) == pytest.approx(scan.rms_ghz, rel=1e-9)
    far = distance_band(one, DRIVE, distance_m=2.0)
    order = np.argsort(scan.up.time)
    about = Conditions(
        time=scan.up.time[order], nu=1e9 * scan.up.frequency[order], distance_m=2.0,
        method="counting-region",
    )  # fmt: skip
    assert far.up[0] == pytest.approx(interpolation_spread(about, draws=64), rel=1e-9)


def test_no_uncertainty_no_band(result):
    exact = np.tile(laplace_draws(result, draws=1).vector.values(result.ecdl), (3, 1))
    band = prediction_band(ModelDraws(result.ecdl, exact, "laplace"), DRIVE)
    assert np.array_equal(band.all_low, band.predicted) and not band.stderr.any()


def test_bands_hold_the_truth_as_often_as_they_say():
    """12 recordings: fewer than 9 hits by chance once in 5000 times at 95 %."""
    hits = np.zeros(3)
    truth = linear.device()
    for seed in range(12):
        data = linear.recording(seed)
        result = linear.fitted(data)
        models = laplace_draws(result, draws=200)
        band = prediction_band(models, DRIVE)
        hits[0] += band.holds(np.asarray(predict(truth, DRIVE)))
        target = linear_scan([10.0], span=20.0, samples=128)[0]
        scan = compensate(result.ecdl, target, identified=Identified.of(data), extrapolate=True)
        seen = linearity(Run(scan.drive, np.asarray(predict(truth, scan.drive)))).rms_ghz
        straight = nonlinearity_band(models, scan)
        for side, (value, ends) in enumerate(
            zip(seen, (straight.up_interval, straight.down_interval), strict=True)
        ):
            hits[1 + side] += ends[0] <= value <= ends[1]
        assert max(straight.model) < straight.up_interval[1]  # the model itself scans straighter
    assert (hits >= 9).all()


def test_a_misfit_of_the_model_widens_the_upper_end_alone(result):
    """By a share of it from nothing to all: 97.5 % of it where parameters add nothing to it."""
    exact = nonlinearity_band(result, DRIVE, draws=400)
    small, large = (nonlinearity_band(result, DRIVE, draws=400, misfit=x) for x in (1e-6, 100.0))
    assert exact.misfit == 0.0 and large.misfit == 100.0
    assert np.array_equal(exact.up, large.up)
    assert small.up_interval == pytest.approx(exact.up_interval, rel=1e-6)
    for side in ("up_interval", "down_interval"):
        assert getattr(large, side)[0] == getattr(exact, side)[0]
        assert getattr(large, side)[1] == pytest.approx(97.5, rel=0.01)
    assert large.to_dict()["up"]["median"] == pytest.approx(50.0, rel=0.02)
    for wrong in (-1.0, np.nan, np.inf):
        with pytest.raises(ValueError, match="Argument `misfit` must be 0 or more and finite"):
            nonlinearity_band(result, DRIVE, misfit=wrong)


@pytest.mark.parametrize(
    ("claim", "misfit"),
    [
        (None, 0.0),
        ({"rms": 0.019, "noise": 0.02}, 0.0),  # noise is all of it
        ({"rms": 0.05, "noise": 0.03}, 0.04),
    ],
)
def test_the_misfit_of_a_certificate_is_the_error_in_runs_left_out(claim, misfit):
    assert _held_out_error(claim) == pytest.approx(misfit)


def test_draws_from_a_model_file(result):
    table = json.loads(json_text(result.to_dict()))
    found = laplace_draws_of(result.ecdl, table, draws=10)
    assert np.allclose(found.values, laplace_draws(result, draws=10).values, rtol=1e-12)
    with pytest.raises(ModelError, match="no standard errors"):
        laplace_draws_of(result.ecdl, {"parameters": {}})
    other = eqx.tree_at(lambda e: e.operator.d, result.ecdl, np.array([12.0]))
    with pytest.raises(ModelError, match="other parameters"):
        laplace_draws_of(other, table)
    table["parameters"]["p_1"]["stderr"] = None
    with pytest.raises(ModelError, match="do not fix p_1"):
        laplace_draws_of(result.ecdl, table)
