"""Recordings that are not of the population: each in the prediction of the others."""

import numpy as np
from jaxtyping import Float

from ._predictive_test import PredictiveTest, adjust_holm, predictive_test
from ._thresholds import THRESHOLDS
from .variances._mixed_model import MixedModel


def leave_one_out(model: MixedModel) -> Float[np.ndarray, " recordings"]:
    """P-value of each recording in the prediction of the others; NaN where it has no estimate.

    The variance between recordings without one of them is a step of Fisher's scoring away, exact
    where estimates have no errors of their own; it is more uncertain in proportion to the degrees
    of freedom.
    """
    out = np.full(len(model.values), np.nan)
    for i in np.flatnonzero(model.known.any(axis=1)):
        out[i] = _test_without(model, int(i)).p_value
    return out


def _test_without(model: MixedModel, i: int) -> PredictiveTest:
    """The recording `i` in the prediction of all others."""
    others = model.known.any(axis=1) & (np.arange(len(model.known)) != i)
    matrix, right = model.terms
    precision = np.linalg.inv(model.covariance) - matrix[i]
    covariance = np.linalg.inv(precision)
    coefficients = covariance @ (right.sum(axis=0) - right[i])
    weighted, weights = model.weighted[others], model.weights[others]
    left = np.where(model.known, model.values - model.design @ coefficients, 0.0)[others]
    pull = np.einsum("mab,mb->ma", weights, left)
    inside = np.einsum("mac,mbc->ab", weighted @ covariance, weighted, optimize=True)
    slope = 0.5 * (pull.T @ pull - weights.sum(axis=0) + inside)
    effects = np.count_nonzero(model.prior == 0.0) // model.size
    units = max(int(others.sum()) + 1 - effects, 2)
    pairs = model.pair_covariance * (units / (units - 1.0))
    step = (pairs @ slope.ravel()).reshape(model.between.shape)
    variances, vectors = np.linalg.eigh(model.between + 0.5 * (step + step.T))
    between = (vectors * np.maximum(variances, 0.0)) @ vectors.T

    at = np.flatnonzero(model.known[i])
    design = model.design[i, at]
    correction = model.corrected_covariance - model.covariance
    variance = (between + model.covariances[i])[np.ix_(at, at)]
    variance = variance + design @ (covariance + correction) @ design.T
    slopes = model.slopes(model.design[i], weighted @ covariance)[:, at][:, :, at]
    difference = model.values[i, at] - design @ coefficients
    return predictive_test(difference, variance, slopes, pairs)


def worst(p_values: Float[np.ndarray, " recordings"]) -> int | None:
    """The recording that is an outlier among all, or `None`."""
    adjusted = adjust_holm(p_values)
    if not np.isfinite(adjusted).any():
        return None
    at = int(np.nanargmin(adjusted))
    return at if adjusted[at] < THRESHOLDS.outlier_level else None
