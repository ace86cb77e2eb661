"""Refits on the base: of effects of which a density tells nothing, or where noise is unknown.

All that are promising short, the best in full; the leaders are refitted on the flexible base, too.
"""

from collections.abc import Callable

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._effect_sets import hypothesis_name
from fitting.diagnosis.which._excess import is_competitive, reduces_nonsynchronous
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.screening._base_remainder import BaseRemainder, orthonormal_basis
from fitting.diagnosis.which.screening._screen import InitialGuesses, Screened, screen_effect
from fitting.diagnosis.which.screening._screened_effects import ScreenedEffects

from ._effect_refit import (
    full_refit,
    refit_with_plays,
    refit_without_hysteresis,
    refit_without_plays,
    short_refit,
)

Progress = Callable[[str], None]
Refitted = tuple[State, float]  # a refit, and its effect's unabsorbed fraction


def refit_all_short(
    refit: Refit,
    start: Candidate,
    screened: ScreenedEffects,
    best: State | None,
    progress: Progress,
) -> list[Refitted]:
    """Short refits of the promising effects, those first that explain most beyond the base.

    `best`: of those that lead there.
    """
    out: list[Refitted] = []
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
    return max((one.flexible_score for one in item[1]), default=0.0)


def refit_all_without_hysteresis(
    refit: Refit, start: Candidate, guesses: InitialGuesses, screened: ScreenedEffects
) -> list[Refitted]:
    """At one rate: refits of each effect from no hysteresis, where it stands alone.

    The effects first, beside the polynomial; those then go on, with hysteresis, that take away a
    share of what the best of them does. None where the flexible base leaves nothing to explain.
    """
    if start.effects or screened.nothing_left or not refit.whitened.recording.one_rate:
        return []  # beside another effect the hysteresis is what that one left of it
    without = refit_without_hysteresis(refit, start.eta_fixed)
    if without is None:
        return []
    refit_polynomial, state = without
    polynomial = orthonormal_basis(refit_polynomial.jacobian_base(state))
    alone = BaseRemainder.beyond_tangent(state, polynomial)
    beside = {
        name: screen_effect(*without, guesses[name], polynomial, alone) for name in screened.guesses
    }
    begun: list[Refitted] = []
    best: State | None = None
    for name, each in sorted(beside.items(), key=_most_explained, reverse=True):
        found = refit_without_plays(without, each, best)
        if found is not None:
            begun.append((found, screened.guesses[name][0].unabsorbed_fraction))
            best = found if best is None else min(best, found, key=lambda end: end.cost)
    share = THRESHOLDS.full_refit_fall
    return [
        (refit_with_plays(refit, found), fraction)
        for found, fraction in begun
        if best is not None and (found is best or is_competitive(found, best, state, share))
    ]


def refit_all_in_full(
    refit: Refit, without: State, best: State | None, short: list[Refitted]
) -> list[Refitted]:
    """Full refits of the promising short ones; the best of each effect, the best of all first.

    `best`: of the effects that lead beyond the flexible base.
    """
    share = THRESHOLDS.full_refit_fall
    full: list[Refitted] = []
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
    first: dict[str, Refitted] = {}
    for pair in sorted(found, key=lambda pair: pair[0].cost):
        first.setdefault(hypothesis_name(pair[0].effects), pair)
    return list(first.values())


def choose_leaders(full: list[Refitted], without: State, best: State | None) -> list[Refitted]:
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
