"""Shares of what a hypothesis explains: of each effect of a pair, and of each run."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.where._residual_profiles import remove_origin
from rapi_jax import Recording


def effect_shares(names: Sequence[str], cost: dict[str, float]) -> dict[str, float] | None:
    """Each effect's share of the fall in chi-square that a pair of them brings.

    The mean over both orders of adding them (Shapley's value), so that what either could explain is
    halved. `cost`: chi-square of each hypothesis by name. `None` for other numbers of effects, or
    where one alone was not refitted.
    """
    if len(names) != 2:
        return None
    a, b = names
    known = [cost.get(name) for name in ("none", a, b, "+".join(sorted(names)))]
    none, first, second, both = (np.nan if c is None else c for c in known)
    fall = none - both
    if not (np.isfinite(fall) and np.isfinite(first + second) and fall > 0):
        return None
    share = float(np.clip(0.5 + (second - first) / fall / 2.0, 0.0, 1.0))
    return {a: share, b: 1.0 - share}


def run_shares(
    recording: Recording,
    without: list[Float[np.ndarray, "_ _"]],
    named: list[Float[np.ndarray, "_ _"]],
    blocks: list[PeriodBlock],
    *,
    own_origin: bool,
) -> list[dict[str, Any]]:
    """Which runs carry the verdict: the fall in mean square that the named effects bring in each.

    `without`, `named`: model less data of each run, in the response's unit; the origin of the
    response is no error. The largest share first; a run that is predicted worse with the effects
    has a negative one.
    """
    both = (remove_origin(errors, blocks, own_origin=own_origin) for errors in (without, named))
    pairs = [tuple(float((e**2).sum()) for e in pair) for pair in zip(*both, strict=True)]
    falls = np.array([before - after for before, after in pairs])
    total = float(np.abs(falls.sum()))
    out = [
        {
            "run": k,
            "name": run.name,
            "excitation_hz": run.drive.excitation_hz,
            "amplitude": run.drive.u_pp,
            "before": float(np.sqrt(before / size)),
            "after": float(np.sqrt(after / size)),
            "share": float(fall / total) if total > 0 else 0.0,
        }
        for k, (run, (before, after), fall, size) in enumerate(
            zip(recording.runs, pairs, falls, [e.size for e in without], strict=True)
        )
    ]
    return sorted(out, key=lambda entry: -entry["share"])
