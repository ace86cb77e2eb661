"""The backward check of a pair: whether one of its effects alone would leave nearly as little.

Each alone is refitted from where the pair ended, too, on the base and on the flexible base. A refit
of one effect may have stopped in a minimum of its own, far above, such as one of a pickup's other
frequencies; a pair that passes by there would be credited with what its second effect does not
explain.
"""

from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._candidate import Candidate
from ._effect_sets import added_effects
from ._excess import excess, nonsynchronous_excess, reduces_nonsynchronous
from ._thresholds import THRESHOLDS
from .refits._density_refit import nearest_base, refit_on_density, refit_on_flexible_base
from .refits._effect_refit import free_eta, refit_beside_jumps
from .refits._flexible_refit import refit_and_search


def check_backward(
    refits: tuple[Refit, Refit],
    none: Candidate,
    singles: Sequence[Candidate],
    pairs: Sequence[Candidate],
) -> tuple[list[Candidate], list[Candidate]]:
    """The single effects, refitted from the pairs' ends, and the pairs that these leave standing.

    `refits`: with `eta` held, and with all of the operator free. `none`: the base's own effects.
    """
    alone = {single.name: single for single in singles}
    standing: dict[str, Candidate] = {}
    for pair in sorted((p for p in pairs if _is_supported(p, alone, none)), key=lambda p: p.cost):
        standing.setdefault(pair.name, pair)  # found beside either of its effects
    for pair in standing.values():
        if not _is_supported(pair, alone, none):  # one alone from another pair's end was enough
            continue
        for single in _refit_members(refits, none, pair, alone):
            known = alone.get(single.name)
            if single.cost < (none if known is None else known).cost:
                alone[single.name] = single
    order = sorted(alone.values(), key=lambda c: c.cost)
    return order, [p for p in standing.values() if _is_supported(p, alone, none)]


def _refit_members(
    refits: tuple[Refit, Refit],
    none: Candidate,
    pair: Candidate,
    singles: dict[str, Candidate],
) -> list[Candidate]:
    """Each effect of `pair` alone, from the pair's end, unless it would leave far more there too.

    `singles`: as they were refitted before, by name.
    """
    refit = _refit_on_density if refits[1].whitener.spectrum.measured else _refit_on_operator
    out = []
    for member in pair.effects:
        left_out = {e.name for e in pair.effects} - {member.name}
        ends = refit(refits, none, pair, left_out, singles.get(member.name))
        if ends is not None:
            state, (on_base, flexible_refit, flexible) = ends
            effects = added_effects(flexible.effects, none.on_base.effects)
            fraction = pair.unabsorbed_fraction
            out.append(
                Candidate(effects, state, refits[1], on_base, flexible_refit, flexible, fraction)
            )
    return out


_Ends = tuple[State, tuple[State, Refit, State]]  # with `eta` held; on the base and the flexible


def _refit_on_density(
    refits: tuple[Refit, Refit],
    none: Candidate,
    pair: Candidate,
    left_out: set[str],
    known: Candidate | None,
) -> _Ends | None:
    """A pair without one of its effects, on its density and on one of its own: the better."""
    there = pair.on_flexible_base
    start = pair.flexible_refit.evaluate(there.values, _without(there.effects, left_out))
    if not np.isfinite(start.cost):
        return None
    near = refit_and_search(pair.flexible_refit, start, none.cost)
    if known is not None and (
        _is_far_above(near, there) and _is_far_above(known.on_flexible_base, there)
    ):
        return None
    bases = (pair.on_base.values, none.on_base.values)  # the pair's may follow what is left out
    values = nearest_base(refits[1], bases, near.effects)
    on_base, refit, end = refit_on_density(refits[1], values, near.effects, none.cost)
    if near.cost < end.cost:
        refit, end = pair.flexible_refit, near
    return on_base, (on_base, refit, end)


def _refit_on_operator(
    refits: tuple[Refit, Refit],
    none: Candidate,
    pair: Candidate,
    left_out: set[str],
    known: Candidate | None,
) -> _Ends | None:
    """The same where noise is unknown: on the base first, then on a flexible operator."""
    eta_fixed, free = refits
    start = eta_fixed.evaluate(pair.eta_fixed.values, _without(pair.eta_fixed.effects, left_out))
    if not np.isfinite(start.cost):
        return None
    state = refit_beside_jumps(eta_fixed, start, THRESHOLDS.short_steps)
    if known is not None and (
        _is_far_above(state, pair.eta_fixed)
        and _is_far_above(known.on_flexible_base, pair.on_flexible_base)
    ):
        return None
    state = refit_beside_jumps(eta_fixed, state, THRESHOLDS.full_steps)
    on_base, refit, end = refit_on_flexible_base(free, free_eta(free, state), none)
    there = pair.on_flexible_base
    start = pair.flexible_refit.evaluate(there.values, _without(there.effects, left_out))
    if np.isfinite(start.cost):
        near = refit_and_search(pair.flexible_refit, start, none.cost)
        if near.cost < end.cost:
            refit, end = pair.flexible_refit, near
    return state, (on_base, refit, end)


def _without(effects: Effects, names: set[str]) -> Effects:
    return tuple(effect for effect in effects if effect.name not in names)


def _is_far_above(single: State, pair: State) -> bool:
    """Whether an effect alone leaves so much more than the pair that no other minimum is near."""
    lines = pair.errors.synchronous.size + pair.errors.nonsynchronous.size
    return excess(single) > THRESHOLDS.far_above * max(excess(pair), float(lines))


def _is_supported(pair: Candidate, singles: dict[str, Candidate], none: Candidate) -> bool:
    """Whether neither of the two alone leaves nearly as little.

    On the base too, where there is more to gain: what a second effect takes away only beside a
    hysteresis that adapted to it is not its own. Where neither was refitted alone, which explained
    too little for that, the two are held against none.
    """
    alone = [singles[e.name] for e in pair.effects if e.name in singles] or [none]
    gain = min(s.cost for s in alone) - pair.cost
    base_gain = min(s.on_base.cost for s in alone) - pair.on_base.cost
    left = min(excess(s.on_flexible_base) for s in alone)
    # What is non-synchronous no hysteresis could have taken away.
    steadiest = min((s.on_flexible_base for s in alone), key=nonsynchronous_excess)
    share = THRESHOLDS.pair_gain
    enough = (
        base_gain > THRESHOLDS.pair_base_gain * gain and gain > share * left
    ) or reduces_nonsynchronous(pair.on_flexible_base, steadiest, share)
    return gain > THRESHOLDS.chance_fall and enough
