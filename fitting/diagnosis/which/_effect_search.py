"""The search for one more effect: all are screened, the promising refitted with the base, and the
leaders on the flexible base.
"""

from collections.abc import Callable, Iterable

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit
from rapi_jax.effects import AbstractLawEffect

from ._candidate import Candidate
from ._excess import is_unexplained, least_falls
from ._thresholds import THRESHOLDS
from .refits._base_refits import (
    Refitted,
    choose_leaders,
    refit_all_in_full,
    refit_all_short,
    refit_all_without_hysteresis,
)
from .refits._density_refit import refit_on_flexible_base
from .refits._effect_refit import free_eta
from .refits._leading_effects import make_candidate, refit_leading
from .screening._base_remainder import BaseRemainder, orthonormal_basis
from .screening._marginal_refit import refine_guesses
from .screening._screen import InitialGuesses, Screened, screen_effect
from .screening._screened_effects import ScreenedEffects, may_explain

Progress = Callable[[str], None]


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
    out = refit_leading(free, start, none, screened, progress)
    best = min((c.on_base for c in out), key=lambda end: end.cost, default=None)
    short = refit_all_short(eta_fixed, start, screened.without_leading, best, progress)
    short += refit_all_without_hysteresis(eta_fixed, start, guesses, screened)
    progress("the best of them")
    full = refit_all_in_full(eta_fixed, start.eta_fixed, best, sorted(short, key=_cost))
    for state, fraction in choose_leaders(full, start.eta_fixed, best):
        on_base = free_eta(free, state)
        ends = refit_on_flexible_base(free, on_base, start)
        out.append(make_candidate(none, free, state, ends, fraction))
    return _best_of_each(out)


def _screen_all(
    refits: tuple[Refit, Refit],
    start: Candidate,
    guesses: InitialGuesses,
    progress: Progress,
    in_any_case: frozenset[str],
) -> ScreenedEffects:
    """Every guess beside `start`, by what the base and a density of plays about it leave.

    Where a density explains all that the operator does not, it may be another hysteresis, or an
    effect that changes the hysteresis: of these no score tells. Beside another effect such a law
    is refitted where the scores of its guesses, before these were refitted, may be enough.
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
    enough = least_falls(remainder) if start.effects and flexible is not None else (0.0, 0.0)
    laws = frozenset(
        n for n, each in found.items() if isinstance(each[0].effect, AbstractLawEffect)
    )
    found = _that_may_explain(found, enough, in_any_case)
    if start.effects:
        in_any_case |= laws & found.keys()  # where the base follows, they explain more
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
            marginal=None if flexible is None else flexible.marginal,
        )
    beyond = max((one.flexible_score for each in found.values() for one in each), default=0.0)
    taken_up = beyond <= THRESHOLDS.chance_fall and is_unexplained(start.on_base)
    return ScreenedEffects(
        found,
        telling=measured,
        least=THRESHOLDS.screened_chance,
        in_any_case=in_any_case | (laws if taken_up else frozenset()),
        marginal=None if flexible is None else flexible.marginal,
        nothing_left=flexible is not None and not is_unexplained(start.on_flexible_base),
    )


def _that_may_explain(
    found: dict[str, list[Screened]], enough: tuple[float, float], in_any_case: frozenset[str]
) -> dict[str, list[Screened]]:
    return {
        name: each
        for name, each in found.items()
        if name in in_any_case or may_explain(each, *enough)
    }


def _cost(refitted: Refitted) -> float:
    return refitted[0].cost


def _best_of_each(candidates: Iterable[Candidate]) -> list[Candidate]:
    """The best of each set of effects."""
    best: dict[str, Candidate] = {}
    for one in sorted(candidates, key=lambda c: c.cost):
        best.setdefault(one.name, one)
    return list(best.values())
