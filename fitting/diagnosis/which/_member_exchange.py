"""Pairs in which another effect takes one's place, begun where the best pair ended.

Beside a first effect alone the base follows what is missing, and of effects that act alike only
those are refitted that explain most beside such a base. From the pair's own base, and beside its
other effect as it was found there, an effect that explains as much as the one it replaces is a
rival that the answer must weigh.
"""

import dataclasses
from collections.abc import Collection, Sequence

import numpy as np

from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractEffect

from ._candidate import Candidate
from ._effect_sets import acts_on_drive, added_effects, hypothesis_name
from ._excess import is_rival, is_unexplained
from ._thresholds import THRESHOLDS
from .refits._density_refit import (
    is_near_base,
    refit_about_or_on_density,
    refit_on_flexible_base,
)
from .refits._effect_refit import refit_beside_jumps
from .refits._flexible_refit import refit_and_search
from .refits._leading_effects import make_candidate
from .screening._base_remainder import BaseRemainder, orthonormal_basis
from .screening._marginal_refit import refine_guesses
from .screening._screen import Screened, initial_guesses, screen_effect
from .screening._screened_effects import may_explain

Classes = Sequence[type[AbstractEffect]]


def exchange_members(
    free: Refit, none: Candidate, pairs: Sequence[Candidate], classes: Classes
) -> list[Candidate]:
    """The pairs, and those in which one effect of the best is exchanged, each set at its best.

    Where too much is left the pair itself is refitted from its end, with its two effects on the
    drive in the other order, and with one that jumps found anew. From a new best one only sets that
    are not known yet. `free`: with all of the operator free. `none`: the base's own effects.
    """
    found = {pair.name: pair for pair in sorted(pairs, key=_cost, reverse=True)}
    best, known = min(found.values(), key=_cost, default=None), set()
    for _ in range(THRESHOLDS.exchange_rounds):
        if best is None:
            break
        for pair in _exchanged(free, none, best, classes, known):
            if pair.name not in found or pair.cost < found[pair.name].cost:
                found[pair.name] = pair
        new, known = min(found.values(), key=_cost), found.keys()
        best = new if new.name != best.name else None
    return list(found.values())


def _exchanged(
    free: Refit, none: Candidate, pair: Candidate, classes: Classes, known: Collection[str]
) -> list[Candidate]:
    """Those with an effect in the place of one of `pair`, but for sets that are `known`; itself."""
    starts, found = [], []
    for gone in pair.effects:
        kept = tuple(e for e in pair.on_flexible_base.effects if e.name != gone.name)
        others = [cls for cls in classes if cls.name not in {e.name for e in pair.effects}]
        starts += _rivals(free, pair, kept, others)
        if is_unexplained(pair.on_flexible_base) and not type(gone).smooth:
            starts += _rivals(free, pair, kept, [type(gone)])
    for start in starts:
        if hypothesis_name(added_effects(start.effects, none.on_base.effects)) in known:
            continue
        near = pair.flexible_refit.whitener.misfit is None or is_near_base(free, start, none)
        if near and is_rival(start, pair.on_flexible_base):
            found.append(_refit(free, pair, start, none))
    if is_unexplained(pair.on_flexible_base):
        for effects in _in_each_order(pair):
            begun = free.evaluate(pair.on_base.values, effects)
            found.append(refit_on_flexible_base(free, begun, none))
    return [make_candidate(none, free, e[0], e, pair.unabsorbed_fraction) for e in found]


def _refit(
    free: Refit, pair: Candidate, start: State, none: Candidate
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on the flexible base: on the pair's, or on one of its own."""
    if free.whitener.spectrum.measured:
        return refit_about_or_on_density(free, pair.flexible_refit, start, none)
    begun = free.evaluate(pair.on_base.values, start.effects)
    on_base = refit_beside_jumps(free, begun, THRESHOLDS.free_eta_steps)
    return on_base, pair.flexible_refit, refit_and_search(pair.flexible_refit, start, none.cost)


def _in_each_order(pair: Candidate) -> list[Effects]:
    """The effects of a pair as it ended, and with the two on the drive, if they are, exchanged."""
    there, names = pair.on_flexible_base.effects, {effect.name for effect in pair.effects}
    at = [k for k, e in enumerate(there) if e.name in names and acts_on_drive(e)]
    if len(at) < 2:
        return [there]
    other = list(there)
    other[at[0]], other[at[1]] = there[at[1]], there[at[0]]
    return [there, tuple(other)]


def _rivals(free: Refit, pair: Candidate, kept: Effects, others: Classes) -> list[State]:
    """Beside `kept`, on the pair's flexible base: what may explain as much as its other effect.

    Those first that explain most, and drive effects in both orders.
    """
    values, misfit = pair.on_flexible_base.values, pair.flexible_refit.whitener.misfit
    if misfit is None:  # the flexible base was searched, and stays as it is
        refit = pair.flexible_refit
        still = dataclasses.replace(refit.base, free=np.zeros_like(refit.base.free))
        marginal = dataclasses.replace(refit, base=still)
    else:
        refit, marginal = free, pair.flexible_refit
    start, without = refit.evaluate(values, kept), marginal.evaluate(values, kept)
    if not np.isfinite(without.cost):
        return []
    basis = orthonormal_basis(refit.jacobian_base(start))
    remainder = (
        BaseRemainder.beyond_tangent(start, basis)
        if misfit is None
        else BaseRemainder.beyond_density(start, misfit)
    )
    least = THRESHOLDS.leader_fall * (without.cost - pair.cost)
    found = {
        name: screen_effect(refit, start, grid, basis, remainder)
        for name, grid in initial_guesses(refit, start, others).items()
    }
    found = {name: each for name, each in found.items() if each and may_explain(each, least)}
    refined = refine_guesses(marginal, start, found)
    ways = [
        one
        for each in refined.values()
        if may_explain(each, least)
        for one in _best_of_each_order(each)
    ]
    begun = [marginal.evaluate(values, one.beside(kept)) for one in ways]
    ends = [refit_beside_jumps(marginal, state, THRESHOLDS.short_steps) for state in begun]
    return sorted(ends, key=lambda end: end.cost)[: THRESHOLDS.pair_leaders]


def _best_of_each_order(guesses: list[Screened]) -> list[Screened]:
    parts = ([one for one in guesses if one.other_order is way] for way in (False, True))
    return [max(part, key=_score) for part in parts if part]


def _score(one: Screened) -> float:
    return one.flexible_score


def _cost(candidate: Candidate) -> float:
    return candidate.cost
