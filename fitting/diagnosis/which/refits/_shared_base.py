"""Flexible bases exchanged between candidates, where the base is searched.

Where noise is unknown the base has no closed form, and the search for it ends in one of many
minima, decided by rounding. A candidate beside which it ended well would then be credited with the
base; so all others are refitted from the best one's, and again while another becomes the best.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.which._candidate import Candidate

from ._flexible_refit import refit_and_search

_ROUNDS = 8  # of a servo's recording the best stays the best after five


def share_flexible_base(none: Candidate, candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates, each from the flexible base of the best where that leaves less; in order.

    No cost rises. `none`: the base's own effects alone; where its base is the identified one, see
    `refit_on_flexible_base`, nothing was searched.
    """
    if none.flexible_refit is none.refit:
        return list(candidates)
    every = list(candidates)
    for _ in range(_ROUNDS):
        best = min(every, key=lambda c: c.cost, default=none)
        shared = [c if c is best else _from_base_of(best, c, none) for c in every]
        fell = any(new is not old for new, old in zip(shared, every, strict=True))
        every = shared
        if not fell or min(every, key=lambda c: c.cost) is best:
            break
    return every


def _from_base_of(best: Candidate, one: Candidate, none: Candidate) -> Candidate:
    """`one` with the flexible base of `best`, if it ends lower from there."""
    refit, values = best.flexible_refit, best.on_flexible_base.values
    starts = [
        refit.evaluate(values, effects)
        for effects in (one.on_flexible_base.effects, one.on_base.effects)
    ]
    start = min(starts, key=lambda state: state.cost if np.isfinite(state.cost) else np.inf)
    if not np.isfinite(start.cost):
        return one
    end = refit_and_search(refit, start, none.cost)
    if not end.cost < one.cost:
        return one
    return dataclasses.replace(one, on_flexible_base=end, flexible_refit=refit)
