"""Refits of effects on the flexible base: a density of plays, integrated out in closed form.

Plays are linear in their weights, so nothing is searched but the effects' few parameters. Without a
measured noise a density has no scale: then an operator with many plays is searched.
"""

import numpy as np

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractEffect

from ._candidate import Candidate
from ._effect_refit import refit_beside_jumps
from ._effect_sets import insert_effect
from ._flexible_refit import refit_and_search, refit_flexible_operator, refit_from_either
from ._thresholds import THRESHOLDS


def refit_on_flexible_base(
    free: Refit,
    on_base: State,
    without: Candidate | None = None,
    guess: AbstractEffect | None = None,
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on the flexible base: a density where noise is measured.

    Elsewhere an operator that is searched. See `refit_on_density`.
    """
    if free.whitener.spectrum.measured:
        return refit_on_density(free, on_base, without, guess)
    if without is None:
        return (on_base, *refit_flexible_operator(free, on_base))
    lacking = without.flexible_refit, without.on_flexible_base
    return (on_base, *refit_from_either(free, on_base, lacking))


def refit_on_density(
    free: Refit,
    on_base: State,
    without: Candidate | None = None,
    guess: AbstractEffect | None = None,
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on a density about it, each from the other's effects.

    `free`: with all of the operator free. `without`: lacks the further effect, of which `guess` is
    another start.
    """
    steps, most = THRESHOLDS.free_eta_steps, on_base.cost
    if without is not None:
        most = without.cost
        if guess is not None:
            base = without.on_base
            start = free.evaluate(base.values, insert_effect(base.effects, guess))
            if np.isfinite(start.cost):
                other = refit_beside_jumps(free, start, steps)
                on_base = min(on_base, other, key=_cost)
    marginal = FlexibleBase.about(free, on_base).marginal
    best = refit_and_search(marginal, marginal.evaluate(on_base.values, on_base.effects), most)
    for _ in range(THRESHOLDS.density_rounds - 1 if best.effects else 0):
        moved = refit_beside_jumps(free, free.evaluate(on_base.values, best.effects), steps)
        if not moved.cost < (1.0 - THRESHOLDS.density_round_gain) * on_base.cost:
            break
        on_base = moved
        about = FlexibleBase.about(free, on_base).marginal
        end = refit_and_search(about, about.evaluate(on_base.values, on_base.effects), most)
        if end.cost < best.cost:
            marginal, best = about, end
    return on_base, marginal, best


def _cost(state: State) -> float:
    return state.cost
