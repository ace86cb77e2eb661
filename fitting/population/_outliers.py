"""Recordings that are not of the population: each in the prediction of the others."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting._multiple_tests import adjust_holm

from ._predictive_test import PredictiveTest, predictive_test
from ._thresholds import THRESHOLDS
from .variances._mixed_model import MixedModel


def leave_one_out(model: MixedModel) -> Float[np.ndarray, " recordings"]:
    """P-value of each recording in the prediction of the others; NaN where it has no estimate."""
    out = np.full(len(model.values), np.nan)
    for i in np.flatnonzero(model.known.any(axis=1)):
        out[i] = _test_without(model, int(i)).p_value
    return out


def without_one(model: MixedModel, i: int) -> MixedModel:
    """The model of all recordings but `i`.

    Its variance between recordings is a step of Fisher's scoring away, exact where estimates have
    no errors of their own.
    """
    others = model.known & (np.arange(len(model.known)) != i)[:, None]
    keep = others.any(axis=1)
    matrix, right = model.terms
    covariance = np.linalg.inv(matrix.sum(axis=0) - matrix[i] + np.diag(model.prior))
    coefficients = covariance @ (right.sum(axis=0) - right[i])
    weighted, weights = model.weighted[keep], model.weights[keep]
    left = np.where(others, model.values - model.design @ coefficients, 0.0)[keep]
    pull = np.einsum("mab,mb->ma", weights, left)
    inside = np.einsum("mac,mbc->ab", weighted @ covariance, weighted, optimize=True)
    slope = 0.5 * (pull.T @ pull - weights.sum(axis=0) + inside)
    effects = np.count_nonzero(model.prior == 0.0) // model.size
    units = max(int(keep.sum()) + 1 - effects, 2)
    step = (model.pair_covariance @ slope.ravel()).reshape(model.between.shape)
    step *= units / (units - 1.0)
    variances, vectors = np.linalg.eigh(model.between + 0.5 * (step + step.T))
    between = (vectors * np.maximum(variances, 0.0)) @ vectors.T
    return dataclasses.replace(model, known=others, between=between)


def _test_without(model: MixedModel, i: int) -> PredictiveTest:
    """The recording `i` in the prediction of all others."""
    others = without_one(model, i)
    at = np.flatnonzero(model.known[i])
    design = model.design[i]
    variance = (others.predictive(design) + model.covariances[i])[np.ix_(at, at)]
    difference = (model.values[i] - design @ others.coefficients)[at]
    slopes = others.slopes(design)[:, at][:, :, at]
    return predictive_test(difference, variance, slopes, others.pair_covariance)


def worst(p_values: Float[np.ndarray, " recordings"]) -> int | None:
    """The recording that is an outlier among all, or `None`."""
    adjusted = adjust_holm(p_values)
    if not np.isfinite(adjusted).any():
        return None
    at = int(np.nanargmin(adjusted))
    return at if adjusted[at] < THRESHOLDS.outlier_level else None
