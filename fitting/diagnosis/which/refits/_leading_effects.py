"""Refits of effects that lead beyond the flexible base where noise is measured: there alone."""

import dataclasses
from collections.abc import Callable

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._effect_sets import added_effects
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.screening._screen import Screened
from fitting.diagnosis.which.screening._screened_effects import ScreenedEffects

from ._density_refit import refit_on_density
from ._flexible_refit import refit_and_search

Progress = Callable[[str], None]


def refit_leading(
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
        bases = [_best_start(free, start, each) for each in screened.starts_on_flexible_base(name)]
        ends = [
            refit_on_density(free, base.values, base.effects, start.cost)
            for base in bases
            if base is not None
        ]
        if ends:
            best = min(ends, key=lambda end: end[2].cost)
            if screened.marginal is not None:
                best = _where_it_began(screened.marginal, start, one, best)
            out.append(make_candidate(none, free, best[0], best, one.unabsorbed_fraction))
    return out


def _where_it_began(
    marginal: Refit, start: Candidate, one: Screened, ends: tuple[State, Refit, State]
) -> tuple[State, Refit, State]:
    """`ends`, or the density about the base without the effect where that leaves less beside it.

    `marginal`: see `ScreenedEffects`. See `refit_about_or_on_density`.
    """
    effects = one.beside(start.on_base.effects)
    near = marginal.evaluate(start.on_base.values, effects)
    if not near.cost < ends[2].cost:
        return ends
    return ends[0], marginal, refit_and_search(marginal, near, start.cost)


def _best_start(free: Refit, start: Candidate, guesses: list[Screened]) -> State | None:
    """The base refitted beside each of an effect's guesses, which are held: where it leaves least.

    `None` where no guess has a finite response.
    """
    held = dataclasses.replace(free, hold_effects=True)
    effects, values = start.on_flexible_base.effects, start.on_base.values
    begins = [held.evaluate(values, one.beside(effects)) for one in guesses]
    begins = [state for state in begins if np.isfinite(state.cost)]
    if len(begins) > 1:
        begins = [held.minimise(state, THRESHOLDS.short_steps) for state in begins]
    return min(begins, key=lambda state: state.cost, default=None)


def make_candidate(
    none: Candidate,
    free: Refit,
    eta_fixed: State,
    ends: tuple[State, Refit, State],
    unabsorbed_fraction: float,
) -> Candidate:
    """The hypothesis with these `ends`: on the base, and on which flexible base and there."""
    on_base, flexible_refit, flexible = ends
    effects = added_effects(flexible.effects, none.on_base.effects)
    return Candidate(
        effects, eta_fixed, free, on_base, flexible_refit, flexible, unabsorbed_fraction
    )
