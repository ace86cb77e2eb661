"""A richer hysteresis than the one identified: what it can absorb is not credited to an effect."""

import dataclasses
from typing import NamedTuple

import numpy as np

from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import RAPI, parameters
from rapi_jax.operators import GeneralRAPI

PLAYS = 24
ORDER = 4
_REACH = 1.6  # of the widest threshold identified: how far the added plays go
# How far a value of a play may go from where it starts (one standard deviation).
_THRESHOLD = 0.25  # of itself
_SHAPE = 0.3  # `lam`
_INTERCEPT = 0.4  # `eta`
_WEIGHT = 0.5  # of the largest weight identified
_DECAY = (0.4, 0.2)  # of the logarithm of a weight, at the widest threshold
_APART = 0.3  # of `zeta`: how far thresholds grow apart
_BEND = 0.07  # of the slope of the falling bound, half a swing from the middle
_START = 0.3  # initial fractions


def flexible_base(whitened: WhitenedModel, base: BaseModel, values: np.ndarray) -> BaseModel | None:
    """The operator at `values` with 24 plays, each with a threshold, shape and weight of its own.

    Falling bounds may bend, thresholds grow apart, weights decay in another way (`GeneralRAPI`).
    It begins as the same function of the drive: the plays added have no weight yet. `None` for an
    operator that is no `RAPI`.
    """
    operator = whitened.set_values(base.operator, values)
    if not isinstance(operator, RAPI):
        return None
    old, plays = operator.count, max(operator.count, PLAYS)
    rank = np.arange(1, old + 1) / old

    def each(name: str) -> np.ndarray:
        return np.broadcast_to(np.asarray(getattr(operator, name)), (old,)).copy()

    share = each("alpha") * rank  # thresholds in half peak-to-peak drives, at rate 0
    widest = share.max() * _REACH
    grid = widest * (np.arange(plays) + 0.5) / plays
    far = np.abs(grid[:, None] - share[None, :]).min(axis=1)
    more = np.sort(grid[np.argsort(-far)[: plays - old]])
    shares = np.concatenate([share, more])
    order = np.argsort(shares)

    def spread(name: str) -> np.ndarray:
        rest = np.interp(more, np.sort(share), each(name)[np.argsort(share)])
        return np.concatenate([each(name), rest])[order]

    shares = shares[order]
    weights = np.concatenate([each("a"), np.zeros(more.size)])[order]
    d = np.asarray(operator.d)
    drives = whitened.recording.drives
    rich = GeneralRAPI(
        alpha=shares * plays / np.arange(1, plays + 1),
        zeta=[float(operator.zeta), 0.0],
        lam=spread("lam"),
        eta=spread("eta"),
        a=weights,
        b=[float(operator.b), 0.0],
        u_0=np.mean([(d.value.max() + d.value.min()) / 2.0 for d in drives]),
        d=np.concatenate([d, np.zeros(max(ORDER - d.size, 0))]),
        d_0=operator.d_0,
        plays=plays,
    )
    u_pp, rate = max(d.u_pp for d in drives), max(d.rate for d in drives)
    r = shares * u_pp / 2.0 + float(operator.zeta) * rate
    return with_priors(whitened, rich, Scales(float(np.abs(weights).max()), float(r.max()), u_pp))


class Scales(NamedTuple):
    """By what the freedom of the richer base is measured."""

    weight: float  # the largest
    threshold: float  # the largest of any run
    u_pp: float  # the largest


def with_priors(whitened: WhitenedModel, rich: GeneralRAPI, scales: Scales) -> BaseModel:
    """Priors of the plays' own values about those of `rich`; weights may be negative."""
    base = BaseModel.of(whitened, rich)
    prior, at = base.prior_std.copy(), 0
    decay = np.array(_DECAY) / scales.threshold ** np.array([1.0, 2.0])
    for p in parameters(rich):
        part = slice(at, at + p.size)
        here = base.prior_mean[part]
        if p.name == "alpha":
            prior[part] = np.maximum(_THRESHOLD * np.abs(here), 1e-3)
        elif p.name == "lam":
            prior[part] = _SHAPE
        elif p.name == "eta":
            prior[part] = _INTERCEPT
        elif p.name == "a":
            prior[part] = _WEIGHT * scales.weight
        elif p.name == "zeta":
            least = np.maximum(np.abs(here[:1]), 1e-4)
            prior[part] = np.concatenate([least, _APART * least])
        elif p.name == "b":
            prior[part] = decay
        elif p.name == "bow":
            prior[part] = _BEND / (scales.u_pp / 2.0)
        at += p.size
    prior[at:] = _START
    return dataclasses.replace(base, prior_std=prior).with_fixed("u_0")
