"""The flexible operator: a richer hysteresis than the one identified, with many plays.

It predicts, as a density of plays does not; where noise is unknown it is the flexible base.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import parameters

from ._thresholds import THRESHOLDS


def flexible_operator(
    whitened: WhitenedModel, base: BaseModel, values: np.ndarray
) -> BaseModel | None:
    """The flexible form of the operator at `values`, with priors about where it begins.

    It begins as the same function of the drive. `None` for an operator that has no such form.
    """
    form = whitened.set_values(base.operator, values).flexible(whitened.recording)
    if form is None:
        return None
    richer = BaseModel.of(whitened, form.operator)
    prior, at = richer.prior_std.copy(), 0
    for p in parameters(form.operator):
        if p.name in form.deviations:
            prior[at : at + p.size] = form.deviations[p.name]
        at += p.size
    prior[at:] = THRESHOLDS.initial_prior
    return dataclasses.replace(richer, prior_std=prior).with_fixed(*form.held)
