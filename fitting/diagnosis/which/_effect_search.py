"""The search for one more effect: every candidate refitted with the base, leaders on the flexible
base.
"""

from collections.abc import Callable, Iterable

from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._candidate import Candidate, added_effects, hypothesis_name
from ._effect_refit import (
    free_eta,
    full_refit,
    refit_from_no_hysteresis,
    refit_without_hysteresis,
    short_refit,
)
from ._excess import is_competitive, reduces_nonsynchronous
from ._flexible_refit import refit_on_flexible_base
from ._screen import InitialGuesses, orthonormal_basis, screen_effect
from ._thresholds import THRESHOLDS

Progress = Callable[[str], None]
_Refitted = tuple[State, float]  # a refit, and its effect's unabsorbed fraction


def search_one_effect(
    refits: tuple[Refit, Refit],
    start: Candidate,
    none: Candidate,
    guesses: InitialGuesses,
    progress: Progress,
) -> list[Candidate]:
    """Every effect of `guesses` beside those of `start`; the leaders also on the flexible base.

    `refits`: with `eta` held, and with all of the operator free. `none`: the base's own effects.
    """
    eta_fixed, free = refits
    short = _refit_short(eta_fixed, start, guesses, progress)
    progress("the best of them")
    full = _refit_in_full(eta_fixed, start.eta_fixed, short)
    own = none.on_base.effects
    out = []
    for state, fraction in _leaders(full, start.eta_fixed):
        progress(f"{hypothesis_name(added_effects(state.effects, own))} on the flexible base")
        on_base = free_eta(free, state)
        flexible_refit, flexible = refit_on_flexible_base(
            free, on_base, (start.flexible_refit, start.on_flexible_base)
        )
        effects = added_effects(flexible.effects, own)
        out.append(Candidate(effects, state, on_base, flexible, flexible_refit, fraction))
    return out


def _refit_short(
    refit: Refit, start: Candidate, guesses: InitialGuesses, progress: Progress
) -> list[_Refitted]:
    """Short refits of each effect, the best first.

    At one rate also from no hysteresis, where no other effect stands beside it yet.
    """
    state = start.eta_fixed
    basis = orthonormal_basis(refit.jacobian_base(state))
    flexible_basis = orthonormal_basis(start.flexible_refit.jacobian_base(start.on_flexible_base))
    first = not start.effects  # else the hysteresis is what the other effect left of it
    without = refit_without_hysteresis(refit, state) if first and _has_one_rate(refit) else None
    out: list[_Refitted] = []
    for name, grid in guesses.items():
        progress(name)
        screened = screen_effect(refit, state, grid, basis, flexible_basis)
        if not screened:
            continue
        fraction = screened[0].unabsorbed_fraction
        found = short_refit(refit, state, screened)
        if found is not None:
            out.append((found, fraction))
        if without is not None:
            polynomial = orthonormal_basis(without[0].jacobian_base(without[1]))
            screened = screen_effect(*without, grid, polynomial, polynomial)
            found = refit_from_no_hysteresis(refit, without, screened)
            if found is not None:
                out.append((found, fraction))
    return sorted(out, key=_cost)


def _refit_in_full(refit: Refit, without: State, short: list[_Refitted]) -> list[_Refitted]:
    """Full refits of the promising short ones; the best of each effect, the best of all first."""
    share = THRESHOLDS.full_refit_fall
    full: list[_Refitted] = []
    for state, fraction in short:
        best = min((end for end, _ in full), key=lambda end: end.cost, default=None)
        if (
            best is None
            or is_competitive(state, best, without, share)
            or reduces_nonsynchronous(state, without, share)
        ):
            full.append((full_refit(refit, state, without.cost), fraction))
    return _best_of_each(pair for pair in full if pair[0].cost < without.cost)


def _leaders(full: list[_Refitted], without: State) -> list[_Refitted]:
    """Those that are refitted on the flexible base; the best at least."""
    best = full[0][0] if full else without
    leaders = []
    for k, (state, fraction) in enumerate(full):
        first = k <= THRESHOLDS.leaders
        if (
            first and is_competitive(state, best, without, THRESHOLDS.leader_fall)
        ) or reduces_nonsynchronous(state, without, THRESHOLDS.full_refit_fall):
            leaders.append((state, fraction))
    return leaders or full[:1]


def _cost(refitted: _Refitted) -> float:
    return refitted[0].cost


def _best_of_each(refitted: Iterable[_Refitted]) -> list[_Refitted]:
    """The best refit of each effect, the best of all first."""
    best: dict[str, _Refitted] = {}
    for pair in sorted(refitted, key=_cost):
        best.setdefault(hypothesis_name(pair[0].effects), pair)
    return list(best.values())


def _has_one_rate(refit: Refit) -> bool:
    """Whether all runs have about one rate: a lag and hysteresis then look alike."""
    rates = refit.whitened.recording.rates
    return bool(max(rates) <= THRESHOLDS.equal_rates * min(rates))
