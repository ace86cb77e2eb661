"""The flexible form of the RA-PI family: more plays, each with a shape and weight of its own."""

import numpy as np

from rapi_jax._parameter import parameters
from rapi_jax.recording._recording import Recording

from ._base import AbstractOperator, FlexibleForm
from ._general_rapi import GeneralRAPI
from ._guess import largest_half_swing, middle_drive
from ._thresholds import THRESHOLDS


def flexible_form(operator: AbstractOperator, recording: Recording) -> FlexibleForm:
    """`operator` as a `GeneralRAPI` with 24 plays whose values are all their own.

    `operator`: a `RAPI`, `FixedRAPI` or `MixedRAPI`; thresholds keep its law. Falling bounds may
    bend, thresholds grow apart, weights decay by another law. It begins as the same function of the
    drive: the plays added have no weight yet.
    """
    limits, half = THRESHOLDS, largest_half_swing(recording)
    absent = {"alpha", "rho"} - {p.name for p in parameters(operator)}
    value = {
        name: np.asarray(getattr(operator, name)) for name in ("zeta", "b", "d", "d_0", "origin")
    }
    old, plays = operator.count, max(operator.count, limits.flexible_plays)
    rank = np.arange(1, old + 1) / old

    def each(name: str) -> np.ndarray:
        return np.broadcast_to(np.asarray(getattr(operator, name, 0.0)), (old,)).copy()

    # Thresholds at rate 0 in half peak-to-peak drives of the largest amplitude, and what part of
    # each is fixed.
    share = each("alpha") * rank + each("rho") * rank / half
    part = each("rho") * rank / half / np.where(share > 0, share, 1.0)
    widest = share.max() * limits.flexible_reach
    grid = widest * (np.arange(plays) + 0.5) / plays
    far = np.abs(grid[:, None] - share[None, :]).min(axis=1)
    more = np.sort(grid[np.argsort(-far)[: plays - old]])
    shares = np.concatenate([share, more])
    order = np.argsort(shares)

    def with_more(own: np.ndarray) -> np.ndarray:
        rest = np.interp(more, np.sort(share), own[np.argsort(share)])
        return np.concatenate([own, rest])[order]

    shares, parts = shares[order], with_more(part)
    widest_play = shares * plays / np.arange(1, plays + 1)
    weights = np.concatenate([each("a"), np.zeros(more.size)])[order]
    rich = GeneralRAPI(
        alpha=0.0 if "alpha" in absent else widest_play * (1.0 - parts),
        rho=0.0 if "rho" in absent else widest_play * parts * half,
        zeta=[float(value["zeta"]), 0.0],
        lam=with_more(each("lam")),
        eta=with_more(each("eta")),
        a=weights,
        b=[float(value["b"]), 0.0],
        u_0=middle_drive(recording) - value["origin"],
        d=np.concatenate([value["d"], np.zeros(max(limits.flexible_order - value["d"].size, 0))]),
        d_0=value["d_0"],
        origin=value["origin"],
        plays=plays,
    )
    u_pp = max(d.u_pp for d in recording.drives)
    r = shares * u_pp / 2.0 + float(value["zeta"]) * max(d.rate for d in recording.drives)
    growth = np.maximum(np.abs(np.asarray(rich.zeta)[:1]), limits.flexible_growth_least)
    slope = max(run.span for run in recording.runs) / u_pp
    weight = max(
        limits.flexible_weight * float(np.abs(weights).max()), limits.flexible_weight_least * slope
    )
    # Of a sweep that never turns all thresholds may be 0.
    widest = max(float(r.max()), limits.flexible_threshold_least * u_pp / 2.0)
    decay = np.array(limits.flexible_decay) / widest ** np.array([1.0, 2.0])
    least = {
        "alpha": limits.flexible_threshold_least,
        "rho": limits.flexible_threshold_least * half,
    }
    deviations = {
        name: np.maximum(limits.flexible_threshold * np.abs(np.asarray(getattr(rich, name))), size)
        for name, size in least.items()
        if name not in absent
    } | {
        "zeta": np.concatenate([growth, limits.flexible_growth * growth]),
        "lam": limits.flexible_lam,
        "eta": limits.flexible_eta,
        "a": weight,
        "b": decay,
        "bow": limits.flexible_curvature / (u_pp / 2.0),
    }
    return FlexibleForm(rich, deviations, held=("u_0", "origin", *sorted(absent)))
