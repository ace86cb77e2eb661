"""A richer hysteresis than the one identified: what it can absorb is not credited to an effect."""

import dataclasses

import numpy as np

from rapi_jax import RAPI, AbstractOperator
from rapi_jax._parameter import parameters

from ._descend import Base
from ._engine import Engine

PLAYS = 24
ORDER = 4
_REACH = 1.6  # of the widest threshold identified: how far the added plays go
# How far a value of a play may go from where it starts (one standard deviation).
_THRESHOLD = 0.25  # of itself
_SHAPE = 0.3  # `lam`
_INTERCEPT = 0.4  # `eta`
_WEIGHT = 0.5  # of the largest weight identified


def free_base(engine: Engine, base: Base, values: np.ndarray) -> Base | None:
    """The operator at `values` with 24 plays, each with a threshold, shape and weight of its own.

    It begins as the same function of the drive: the plays added have no weight yet. `None` for an
    operator that is no `RAPI`.
    """
    operator = engine.filled(base.operator, values)
    if not isinstance(operator, RAPI):
        return None
    old = operator.count
    if old >= PLAYS:
        return None
    rank = np.arange(1, old + 1) / old

    def each(name: str) -> np.ndarray:
        return np.broadcast_to(np.asarray(getattr(operator, name)), (old,)).copy()

    share = each("alpha") * rank  # thresholds in half peak-to-peak drives, at rate 0
    widest = share.max() * _REACH
    grid = widest * (np.arange(PLAYS) + 0.5) / PLAYS
    far = np.abs(grid[:, None] - share[None, :]).min(axis=1)
    added = np.sort(grid[np.argsort(-far)[: PLAYS - old]])
    shares = np.concatenate([share, added])
    order = np.argsort(shares)

    def spread(name: str) -> np.ndarray:
        rest = np.interp(added, np.sort(share), each(name)[np.argsort(share)])
        return np.concatenate([each(name), rest])[order]

    shares = shares[order]
    weights = np.concatenate([each("a"), np.zeros(added.size)])[order]
    d = np.asarray(operator.d)
    rich = RAPI(
        alpha=shares * PLAYS / np.arange(1, PLAYS + 1),
        zeta=operator.zeta,
        lam=spread("lam"),
        eta=spread("eta"),
        a=weights,
        b=operator.b,
        d=np.concatenate([d, np.zeros(max(ORDER - d.size, 0))]),
        d_0=operator.d_0,
        plays=PLAYS,
    )
    return with_priors(engine, rich, float(np.abs(weights).max()))


def with_priors(engine: Engine, rich: AbstractOperator, weight: float) -> Base:
    """Priors of the plays' own values about those of `rich`; weights may be negative."""
    base = Base.of(engine, rich)
    prior, low, at = base.prior.copy(), base.low.copy(), 0
    for p in parameters(rich):
        part = slice(at, at + p.size)
        here = base.centre[part]
        if p.name == "alpha":
            prior[part] = np.maximum(_THRESHOLD * np.abs(here), 1e-3)
        elif p.name == "lam":
            prior[part] = _SHAPE
        elif p.name == "eta":
            prior[part] = _INTERCEPT
        elif p.name == "a":
            prior[part], low[part] = _WEIGHT * weight, -np.inf
        elif p.name == "zeta":
            prior[part] = np.maximum(np.abs(here), 1e-4)
        elif p.name == "b":
            prior[part] = 0.5
        at += p.size
    prior[at:] = 0.3  # initial fractions
    return dataclasses.replace(base, prior=prior, low=low)
