"""The flexible base: a richer hysteresis than the one identified.

What it can absorb is not credited to an effect.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import RAPI, parameters
from rapi_jax.operators import GeneralRAPI

from ._thresholds import THRESHOLDS


def flexible_base(whitened: WhitenedModel, base: BaseModel, values: np.ndarray) -> BaseModel | None:
    """The operator at `values` with more plays, each with its own threshold, shape and weight.

    Falling bounds may be curved, thresholds may grow apart with the rate, weights may decay with
    the threshold (`GeneralRAPI`). At its centre it is the same function of the drive: the plays
    added have no weight. `None` for an operator that is no `RAPI`.
    """
    operator = whitened.set_values(base.operator, values)
    if not isinstance(operator, RAPI):
        return None
    old, plays = operator.count, max(operator.count, THRESHOLDS.flexible_plays)
    rank = np.arange(1, old + 1) / old

    def by_play(name: str) -> np.ndarray:
        return np.broadcast_to(np.asarray(getattr(operator, name)), (old,)).copy()

    identified = by_play("alpha") * rank  # thresholds in half peak-to-peak drives, at rate 0
    widest = identified.max() * THRESHOLDS.threshold_reach
    grid = widest * (np.arange(plays) + 0.5) / plays
    distance = np.abs(grid[:, None] - identified[None, :]).min(axis=1)
    added = np.sort(grid[np.argsort(-distance)[: plays - old]])
    thresholds = np.concatenate([identified, added])
    order = np.argsort(thresholds)

    def interpolate(name: str) -> np.ndarray:
        new = np.interp(added, np.sort(identified), by_play(name)[np.argsort(identified)])
        return np.concatenate([by_play(name), new])[order]

    thresholds = thresholds[order]
    weights = np.concatenate([by_play("a"), np.zeros(added.size)])[order]
    d = np.asarray(operator.d)
    drives = whitened.recording.drives
    flexible = GeneralRAPI(
        alpha=thresholds * plays / np.arange(1, plays + 1),
        zeta=[float(operator.zeta), 0.0],
        lam=interpolate("lam"),
        eta=interpolate("eta"),
        a=weights,
        b=[float(operator.b), 0.0],
        u_0=np.mean([(d.value.max() + d.value.min()) / 2.0 for d in drives]),
        d=np.concatenate([d, np.zeros(max(THRESHOLDS.flexible_order - d.size, 0))]),
        d_0=operator.d_0,
        plays=plays,
    )
    u_pp, rate = max(d.u_pp for d in drives), max(d.rate for d in drives)
    r = thresholds * u_pp / 2.0 + float(operator.zeta) * rate  # Eq. (11)
    scales = Scales(float(np.abs(weights).max()), float(r.max()), u_pp)
    return with_priors(whitened, flexible, scales)


class Scales(NamedTuple):
    """The units of the flexible base's priors."""

    weight: float  # the largest
    threshold: float  # the largest of any run
    u_pp: float  # the largest


def with_priors(whitened: WhitenedModel, flexible: GeneralRAPI, scales: Scales) -> BaseModel:
    """Priors of the plays' own values about those of `flexible`; weights may be negative."""
    base = BaseModel.of(whitened, flexible)
    prior, at = base.prior_std.copy(), 0
    decay = np.array(THRESHOLDS.decay_prior) / scales.threshold ** np.array([1.0, 2.0])
    for p in parameters(flexible):
        part = slice(at, at + p.size)
        here = base.prior_mean[part]
        if p.name == "alpha":
            prior[part] = np.maximum(
                THRESHOLDS.threshold_prior * np.abs(here), THRESHOLDS.threshold_prior_least
            )
        elif p.name == "lam":
            prior[part] = THRESHOLDS.lam_prior
        elif p.name == "eta":
            prior[part] = THRESHOLDS.eta_prior
        elif p.name == "a":
            prior[part] = THRESHOLDS.weight_prior * scales.weight
        elif p.name == "zeta":
            least = np.maximum(np.abs(here[:1]), THRESHOLDS.zeta_least)
            prior[part] = np.concatenate([least, THRESHOLDS.zeta_growth_prior * least])
        elif p.name == "b":
            prior[part] = decay
        elif p.name == "bow":
            prior[part] = THRESHOLDS.curvature_prior / (scales.u_pp / 2.0)
        at += p.size
    prior[at:] = THRESHOLDS.initial_prior
    return dataclasses.replace(base, prior_std=prior).with_fixed("u_0")
