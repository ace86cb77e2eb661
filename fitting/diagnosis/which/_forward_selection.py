"""Forward selection of effects with a backward check: each effect alone, then pairs."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.mechanism._other_form import with_other_form
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractEffect

from ._backward_check import check_backward
from ._base import FittedBase
from ._candidate import Candidate
from ._effect_search import Progress, search_one_effect
from ._excess import exceeds_chance, exceeds_noise, excess, is_unexplained
from ._member_exchange import exchange_members
from ._nested_costs import nest_costs
from ._thresholds import THRESHOLDS
from .refits._density_refit import refit_on_flexible_base
from .refits._effect_refit import free_eta
from .refits._joint_refit import refit_pairs_at_once
from .refits._shared_base import share_flexible_base
from .screening._screen import InitialGuesses, initial_guesses, own_search_ranges, search_ranges

Classes = Sequence[type[AbstractEffect]]


@dataclasses.dataclass(frozen=True, eq=False)
class Attribution:
    """All hypotheses that were refitted; `none`, then the others by chi-square, least first."""

    none: Candidate
    candidates: tuple[Candidate, ...]

    @property
    def best(self) -> Candidate:
        """The candidate that leaves least."""
        return self.candidates[0] if self.candidates else self.none


def select_effects(fitted: FittedBase, candidates: Classes, progress: Progress) -> Attribution:
    """Refit every candidate, and pairs where one is not enough."""
    state = fitted.state
    own = {effect.name for effect in state.effects}
    classes = [cls for cls in candidates if cls.name not in own]
    guesses = initial_guesses(*fitted.eta_fixed, classes)
    ranges = {k: v for grid in guesses.values() for k, v in search_ranges(grid).items()}
    ranges |= own_search_ranges(*fitted.eta_fixed, classes)
    refit = dataclasses.replace(fitted.refit, search_ranges=ranges)
    refits = (dataclasses.replace(fitted.eta_fixed[0], search_ranges=ranges), refit)
    progress("flexible base")
    none = without_effects(refit, state, fitted.eta_fixed[1])
    singles = search_one_effect(refits, none, none, guesses, progress)
    if not singles:
        return Attribution(none, ())
    none = _refit_none_from_others(none, singles)
    if not refit.whitener.spectrum.measured:
        progress("each from the best one's base")
        singles = share_flexible_base(none, singles)
    singles = nest_costs(none, singles)
    pairs: list[Candidate] = []
    forms = {c.name: c for c in map(with_other_form, singles) if c.has_other_form}
    if not forms and _needs_pairs(none, singles, noise_known=refit.whitener.spectrum.measured):
        for first in _firsts_of_pairs(none, singles):
            progress(f"{first.name} and another")
            found = _refit_pairs(refits, first, none, classes)
            pairs += found
            if not all(exceeds_noise(pair.on_flexible_base) for pair in found):
                break  # the strongest effect and another are enough: none else is looked for
        if may_be_two_at_once(none, singles, pairs):
            progress("two effects at once")
            pairs += _refit_pairs_at_once(refits[1], none, guesses)
        if pairs and explains_most(none, pairs):
            progress("others in the place of one of two")
            pairs = exchange_members(refits[1], none, pairs, classes)
        singles, pairs = check_backward(refits, none, singles, pairs)
    every = [forms.get(c.name, c) for c in nest_costs(none, [*singles, *pairs])]
    return Attribution(none, tuple(sorted(every, key=lambda c: c.cost)))


def without_effects(refit: Refit, on_base: State, eta_fixed: State) -> Candidate:
    """No effect but the base's own, on the flexible base, too."""
    _, flexible_refit, flexible = refit_on_flexible_base(refit, on_base)
    return Candidate((), eta_fixed, refit, on_base, flexible_refit, flexible, 1.0)


def _refit_none_from_others(none: Candidate, singles: list[Candidate]) -> Candidate:
    """`none`, from the flexible bases of the others, without their effects, where one leaves less.

    Else an effect would be credited with a better start. About the base of the best a density is
    taken once more, since the plays that it needs may be others where no effect stands beside them.
    """
    effects, best = none.on_base.effects, min(singles, key=lambda c: c.cost)
    values = best.on_flexible_base.values
    tried = [(best.flexible_refit, values)]
    if none.refit.whitener.spectrum.measured:  # else see `share_flexible_base`
        tried += [(c.flexible_refit, c.on_flexible_base.values) for c in singles if c is not best]
        there = none.refit.evaluate(values, effects)
        if np.isfinite(there.cost):
            tried.append((FlexibleBase.about(none.refit, there).marginal, values))
    starts = [(refit, refit.evaluate(base, effects)) for refit, base in tried]
    refit, start = min(starts, key=lambda one: np.nan_to_num(one[1].cost, nan=np.inf))
    if not np.isfinite(start.cost) or start.cost > THRESHOLDS.none_start_cost * none.cost:
        return none
    end = refit.minimise(start, THRESHOLDS.none_steps, THRESHOLDS.none_tolerance)
    if end.cost < none.cost:
        return dataclasses.replace(none, on_flexible_base=end, flexible_refit=refit)
    return none


def _needs_pairs(none: Candidate, singles: list[Candidate], *, noise_known: bool) -> bool:
    """Whether the best of the hypotheses with one effect at most leaves too much.

    Never where noise is unknown and the flexible base is the identified one: what one effect leaves
    may all be hysteresis that the operator does not have.
    """
    best = min([none, *singles], key=lambda c: c.cost)
    if noise_known:
        return exceeds_chance(best.on_flexible_base)
    if none.flexible_refit is none.refit:
        return False
    limit = THRESHOLDS.pair_excess_unknown_noise * excess(none.on_flexible_base)
    return excess(best.on_flexible_base) > limit


def _firsts_of_pairs(none: Candidate, singles: list[Candidate]) -> list[Candidate]:
    """Beside which a second effect is searched: the best on the flexible base, then on the base.

    Where two effects are missing, the flexible base adapts to one of them, and then the other alone
    may explain nothing on it.
    """
    out: dict[str, Candidate] = {}
    for cost in (lambda c: c.cost, lambda c: c.on_base.cost):
        fall = cost(none) - min(cost(c) for c in singles)
        if fall > THRESHOLDS.chance_fall:
            limit = THRESHOLDS.leader_fall * fall
            near = [c for c in singles if cost(none) - cost(c) > limit]
            room = THRESHOLDS.pair_firsts - len(out)
            out |= {c.name: c for c in sorted(near, key=cost)[:room]}
    return list(out.values())


def _refit_pairs(
    refits: tuple[Refit, Refit], first: Candidate, none: Candidate, classes: Classes
) -> list[Candidate]:
    """Pairs with `first`, which is searched anew beside the other where the two leave too much.

    What was found while the other was missing may be the wrong fringe, or the wrong jump.
    """
    eta_fixed = refits[0]
    others = [c for c in classes if c.name != first.name]
    guesses = initial_guesses(eta_fixed, first.eta_fixed, others)
    pairs = search_one_effect(refits, first, none, guesses, _silent)
    cls = next(c for c in classes if c.name == first.name)
    for k, pair in enumerate(sorted(pairs, key=lambda c: c.cost)[: THRESHOLDS.pair_swaps]):
        smooth = all(type(effect).smooth for effect in pair.effects)
        if not is_unexplained(pair.on_flexible_base) or (k and not smooth):  # jumps take seconds
            continue
        (other,) = (e for e in pair.effects if e.name != first.name)
        kept = (*none.on_base.effects, other)
        alone = eta_fixed.minimise(
            eta_fixed.evaluate(pair.eta_fixed.values, kept), THRESHOLDS.swap_steps
        )
        start = _without_first(refits[1], pair, other, alone)
        again = initial_guesses(eta_fixed, alone, [cls])
        swapped = search_one_effect(
            refits, start, none, again, _silent, in_any_case=frozenset({cls.name})
        )
        if swapped and swapped[0].cost < pair.cost:
            pairs[pairs.index(pair)] = swapped[0]
    return pairs


def explains_most(none: Candidate, candidates: Sequence[Candidate]) -> bool:
    """Whether the best of the candidates leaves little of what no effect leaves.

    If it is a pair, a look-alike of one of the two may leave less.
    """
    left = min((excess(c.on_flexible_base) for c in candidates), default=np.inf)
    return left < THRESHOLDS.pair_leaves * excess(none.on_flexible_base)


def may_be_two_at_once(
    none: Candidate, singles: Sequence[Candidate], pairs: Sequence[Candidate]
) -> bool:
    """Whether two effects may be missing of which neither explains anything alone.

    So where no effect explains most, neither alone nor beside another.
    """
    return not explains_most(none, [*singles, *pairs])


def _refit_pairs_at_once(free: Refit, none: Candidate, guesses: InitialGuesses) -> list[Candidate]:
    """Pairs of which neither effect need explain anything alone; where noise is measured."""
    return refit_pairs_at_once(free, none, guesses) if free.whitener.spectrum.measured else []


def _without_first(free: Refit, pair: Candidate, other: AbstractEffect, alone: State) -> Candidate:
    """A pair's second effect alone, from which the first is searched; on the base it is refitted.

    `alone`: the base with `other`, `eta` held.
    """
    there = pair.on_flexible_base
    first = {effect.name for effect in pair.effects} - {other.name}
    kept = tuple(effect for effect in there.effects if effect.name not in first)
    flexible = pair.flexible_refit.evaluate(there.values, kept)
    return dataclasses.replace(
        pair,
        effects=(other,),
        eta_fixed=alone,
        on_base=free_eta(free, alone),
        on_flexible_base=flexible if np.isfinite(flexible.cost) else there,
    )


def _silent(line: str) -> None:
    pass
