"""The search for one more effect: all are screened, the promising refitted with the base, and the
leaders on the flexible base.
"""

import dataclasses
from collections.abc import Callable, Iterable

import numpy as np

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractLawEffect

from ._candidate import Candidate
from ._density_refit import refit_on_density, refit_on_flexible_base
from ._effect_refit import (
    free_eta,
    full_refit,
    refit_from_no_hysteresis,
    refit_without_hysteresis,
    short_refit,
)
from ._effect_sets import added_effects, hypothesis_name, insert_effect
from ._excess import (
    is_competitive,
    is_unexplained,
    least_fall,
    reduces_nonsynchronous,
)
from ._thresholds import THRESHOLDS
from .screening._base_remainder import BaseRemainder, orthonormal_basis
from .screening._marginal_refit import refine_guesses
from .screening._screen import InitialGuesses, Screened, screen_effect
from .screening._screened_effects import ScreenedEffects, may_explain

Progress = Callable[[str], None]
_Refitted = tuple[State, float]  # a refit, and its effect's unabsorbed fraction


def search_one_effect(
    refits: tuple[Refit, Refit],
    start: Candidate,
    none: Candidate,
    guesses: InitialGuesses,
    progress: Progress,
    *,
    in_any_case: frozenset[str] = frozenset(),
) -> list[Candidate]:
    """Every effect of `guesses` beside those of `start`; the leaders also on the flexible base.

    `refits`: with `eta` held, and with all of the operator free. `none`: the base's own effects.
    `in_any_case`: effects that are refitted whatever their scores.
    """
    eta_fixed, free = refits
    screened = _screen_all(refits, start, guesses, progress, in_any_case)
    out = _refit_leading(free, start, none, screened, progress)
    best = min((c.on_base for c in out), key=lambda end: end.cost, default=None)
    short = _refit_short(eta_fixed, start, screened.without_leading, best, progress)
    short += _refit_without_hysteresis(eta_fixed, start, guesses, screened)
    progress("the best of them")
    full = _refit_in_full(eta_fixed, start.eta_fixed, best, sorted(short, key=_cost))
    for state, fraction in _leaders(full, start.eta_fixed, best):
        on_base = free_eta(free, state)
        ends = refit_on_flexible_base(free, on_base, start)
        out.append(_candidate(none, free, state, ends, fraction))
    return _best_of_each(out)


def _refit_leading(
    free: Refit,
    start: Candidate,
    none: Candidate,
    screened: ScreenedEffects,
    progress: Progress,
) -> list[Candidate]:
    """The effects that lead beyond the flexible base, from where they were refitted there."""
    out: list[Candidate] = []
    for name in screened.leading_on_flexible_base:
        progress(f"{name} on the flexible base")
        one = screened.best_on_flexible_base(name)
        base = _best_start(free, start, screened.tied_on_flexible_base(name))
        if base is not None:
            ends = refit_on_density(free, base.values, base.effects, start.cost)
            out.append(_candidate(none, free, ends[0], ends, one.unabsorbed_fraction))
    return out


def _best_start(free: Refit, start: Candidate, guesses: list[Screened]) -> State | None:
    """The base refitted beside each of an effect's guesses, which are held: where it leaves least.

    `None` where no guess has a finite response.
    """
    held = dataclasses.replace(free, hold_effects=True)
    effects, values = start.on_flexible_base.effects, start.on_base.values
    begins = [held.evaluate(values, insert_effect(effects, one.effect)) for one in guesses]
    begins = [state for state in begins if np.isfinite(state.cost)]
    if len(begins) > 1:
        begins = [held.minimise(state, THRESHOLDS.short_steps) for state in begins]
    return min(begins, key=lambda state: state.cost, default=None)


def _candidate(
    none: Candidate,
    free: Refit,
    eta_fixed: State,
    ends: tuple[State, Refit, State],
    unabsorbed_fraction: float,
) -> Candidate:
    on_base, flexible_refit, flexible = ends
    effects = added_effects(flexible.effects, none.on_base.effects)
    return Candidate(
        effects, eta_fixed, free, on_base, flexible_refit, flexible, unabsorbed_fraction
    )


def _screen_all(
    refits: tuple[Refit, Refit],
    start: Candidate,
    guesses: InitialGuesses,
    progress: Progress,
    in_any_case: frozenset[str],
) -> ScreenedEffects:
    """Every guess beside `start`, by what the base and a density of plays about it leave.

    Where a density explains all that the operator does not, it may be another hysteresis, or an
    effect that changes the hysteresis: of these no score tells.
    """
    (refit, free), state = refits, start.eta_fixed
    basis = orthonormal_basis(refit.jacobian_base(state))
    measured = refit.whitener.spectrum.measured
    flexible = FlexibleBase.about(free, start.on_base) if measured else None
    if flexible is None:  # its density has no scale, and takes up the lag of a servo
        there = start.on_flexible_base
        columns = orthonormal_basis(start.flexible_refit.jacobian_base(there))
        remainder = BaseRemainder.beyond_tangent(there, columns)
    else:
        remainder = BaseRemainder.beyond_density(start.on_base, flexible.covariance)
    found = {}
    for name, grid in guesses.items():
        progress(name)
        found[name] = screen_effect(refit, state, grid, basis, remainder)
    found = {name: each for name, each in found.items() if each}
    enough = least_fall(remainder) if start.effects and flexible is not None else 0.0
    found = _that_may_explain(found, enough, in_any_case)
    if flexible is not None:
        found = refine_guesses(flexible.marginal, start.on_base, found)
    if start.effects:
        found = _that_may_explain(found, enough, in_any_case)
        return ScreenedEffects(
            found,
            telling=measured,
            in_any_case=frozenset(in_any_case & found.keys()),
            least=THRESHOLDS.chance_fall,
            most=THRESHOLDS.pair_leaders,
        )
    beyond = max((one.flexible_score for each in found.values() for one in each), default=0.0)
    taken_up = beyond <= THRESHOLDS.chance_fall and is_unexplained(start.on_base)
    laws = frozenset(
        n for n, each in found.items() if isinstance(each[0].effect, AbstractLawEffect)
    )
    return ScreenedEffects(
        found,
        telling=measured,
        least=THRESHOLDS.screened_chance,
        in_any_case=in_any_case | (laws if taken_up else frozenset()),
    )


def _that_may_explain(
    found: dict[str, list[Screened]], enough: float, in_any_case: frozenset[str]
) -> dict[str, list[Screened]]:
    return {
        name: each
        for name, each in found.items()
        if name in in_any_case or may_explain(each, enough)
    }


def _refit_short(
    refit: Refit,
    start: Candidate,
    screened: ScreenedEffects,
    best: State | None,
    progress: Progress,
) -> list[_Refitted]:
    """Short refits of the promising effects, those first that explain most beyond the base.

    `best`: of those that lead there.
    """
    out: list[_Refitted] = []
    promising = list(screened.promising.items())
    if screened.telling:
        promising.sort(key=_most_explained, reverse=True)
    for name, each in promising:
        progress(name)
        # One whose score tells nothing is tried in full.
        told = screened.telling and _most_explained((name, each)) > THRESHOLDS.chance_fall
        rival = best if told else None
        found = short_refit(refit, start.eta_fixed, each, rival)
        if found is not None:
            out.append((found, each[0].unabsorbed_fraction))
            best = found if best is None else min(best, found, key=lambda end: end.cost)
    return out


def _most_explained(item: tuple[str, list[Screened]]) -> float:
    return max(one.flexible_score for one in item[1])


def _refit_without_hysteresis(
    refit: Refit, start: Candidate, guesses: InitialGuesses, screened: ScreenedEffects
) -> list[_Refitted]:
    """At one rate: refits of each effect from no hysteresis, where it stands alone."""
    if start.effects or not _has_one_rate(refit):
        return []  # beside another effect the hysteresis is what that one left of it
    without = refit_without_hysteresis(refit, start.eta_fixed)
    if without is None:
        return []
    refit_polynomial, state = without
    polynomial = orthonormal_basis(refit_polynomial.jacobian_base(state))
    alone = BaseRemainder.beyond_tangent(state, polynomial)
    out: list[_Refitted] = []
    for name, each in screened.guesses.items():
        beside = screen_effect(*without, guesses[name], polynomial, alone)
        found = refit_from_no_hysteresis(refit, without, beside)
        if found is not None:
            out.append((found, each[0].unabsorbed_fraction))
    return out


def _refit_in_full(
    refit: Refit, without: State, best: State | None, short: list[_Refitted]
) -> list[_Refitted]:
    """Full refits of the promising short ones; the best of each effect, the best of all first.

    `best`: of the effects that lead beyond the flexible base.
    """
    share = THRESHOLDS.full_refit_fall
    full: list[_Refitted] = []
    for state, fraction in short:
        known = [end for end, _ in full] + ([] if best is None else [best])
        least = min(known, key=lambda end: end.cost, default=None)
        if (
            least is None
            or is_competitive(state, least, without, share)
            or reduces_nonsynchronous(state, without, share)
        ):
            full.append((full_refit(refit, state, without.cost), fraction))
    found = [pair for pair in full if pair[0].cost < without.cost]
    first: dict[str, _Refitted] = {}
    for pair in sorted(found, key=_cost):
        first.setdefault(hypothesis_name(pair[0].effects), pair)
    return list(first.values())


def _leaders(full: list[_Refitted], without: State, best: State | None) -> list[_Refitted]:
    """Those to refit on the flexible base, too: the best at least, where none leads there."""
    found = [end for end, _ in full[:1]] + ([] if best is None else [best])
    least = min(found, key=lambda end: end.cost, default=without)
    leaders = []
    for k, (state, fraction) in enumerate(full):
        first = k <= THRESHOLDS.leaders
        if (
            first and is_competitive(state, least, without, THRESHOLDS.leader_fall)
        ) or reduces_nonsynchronous(state, without, THRESHOLDS.full_refit_fall):
            leaders.append((state, fraction))
    return leaders or (full[:1] if best is None else [])


def _cost(refitted: _Refitted) -> float:
    return refitted[0].cost


def _best_of_each(candidates: Iterable[Candidate]) -> list[Candidate]:
    """The best of each set of effects."""
    best: dict[str, Candidate] = {}
    for one in sorted(candidates, key=lambda c: c.cost):
        best.setdefault(one.name, one)
    return list(best.values())


def _has_one_rate(refit: Refit) -> bool:
    """Whether all runs have about one rate: a lag and hysteresis then look alike."""
    rates = refit.whitened.recording.rates
    return bool(max(rates) <= THRESHOLDS.equal_rates * min(rates))
