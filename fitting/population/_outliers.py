"""Recordings that are not of the population: each against the others, without it."""

import dataclasses

import numpy as np
from jaxtyping import Float

from ._mixed_model import MixedModel
from ._predictive_test import PredictiveTest, adjust_holm, predictive_test
from ._thresholds import THRESHOLDS


def leave_one_out(model: MixedModel) -> Float[np.ndarray, " recordings"]:
    """P-value of each recording in the prediction of the others; NaN where it has no estimate.

    The variance between recordings without one of them is a step of Fisher's scoring away, exact
    where estimates have no errors of their own.
    """
    out = np.full(len(model.values), np.nan)
    for i in np.flatnonzero(model.known.any(axis=1)):
        out[i] = _test(_without(model, i), model, i).p_value
    return out


def _without(model: MixedModel, i: int) -> MixedModel:
    """The model of all recordings but one."""
    known = model.known.copy()
    known[i] = False
    matrix, right = model.terms
    covariance = np.linalg.inv(matrix.sum(axis=0) - matrix[i] + np.diag(model.prior))
    coefficients = covariance @ (right.sum(axis=0) - right[i])
    left = np.where(known, model.values - model.design @ coefficients, 0.0)
    pull = np.einsum("mab,mb->ma", model.weights, left)
    keep = known.any(axis=1)
    inside = np.einsum("mac,cd,mbd->ab", model.weighted[keep], covariance, model.weighted[keep],
                       optimize=True)  # fmt: skip
    slope = pull[keep].T @ pull[keep] - (model.weights[keep].sum(axis=0) - inside)
    step = model.pair_covariance @ (0.5 * slope).ravel()
    between = model.between + step.reshape(model.between.shape)
    variances, vectors = np.linalg.eigh(0.5 * (between + between.T))
    between = (vectors * np.maximum(variances, 0.0)) @ vectors.T
    return dataclasses.replace(model, known=known, between=between)


def _test(others: MixedModel, model: MixedModel, i: int) -> PredictiveTest:
    at = np.flatnonzero(model.known[i])
    design = model.design[i]
    variance = others.predictive(design) + model.covariances[i]
    difference = model.values[i] - design @ others.coefficients
    pick = np.ix_(at, at)
    slopes = others.slopes(design)[:, at][:, :, at]
    return predictive_test(difference[at], variance[pick], slopes, others.pair_covariance)


def worst(p_values: Float[np.ndarray, " recordings"]) -> int | None:
    """The recording that is an outlier among all, or `None`."""
    adjusted = adjust_holm(p_values)
    if not np.isfinite(adjusted).any():
        return None
    at = int(np.nanargmin(adjusted))
    return at if adjusted[at] < THRESHOLDS.outlier_level else None
