"""Refits of effects in which a density of plays stands for the flexible base, in closed form.

Plays are linear in their weights, so nothing is searched but the effects' few parameters. Where the
search of the flexible base ends far above its minimum, this tells what an effect leaves.
"""

import numpy as np

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractEffect

from ._candidate import insert_effect
from ._thresholds import THRESHOLDS


def refit_on_density(
    free: Refit,
    on_base: State,
    without: State | None = None,
    guess: AbstractEffect | None = None,
) -> tuple[State, tuple[Refit, State] | None]:
    """The refit on the base, and that on a density about it, each from the other's effects.

    `free`: with all of the operator free. `guess`: the further effect as it is beyond a density
    about `without`, which lacks it: another start. Without a measured noise a density has no scale:
    `None`.
    """
    if not free.whitener.spectrum.measured:
        return on_base, None
    if guess is not None and without is not None:
        start = free.evaluate(without.values, insert_effect(without.effects, guess))
        if np.isfinite(start.cost):
            other = free.minimise(start, THRESHOLDS.free_eta_steps)
            on_base = min(on_base, other, key=lambda end: end.cost)
    best: tuple[Refit, State] | None = None
    for _ in range(THRESHOLDS.density_rounds):
        marginal = FlexibleBase.about(free, on_base).marginal
        start = marginal.evaluate(on_base.values, on_base.effects)
        end = marginal.minimise(start, THRESHOLDS.flexible_steps, THRESHOLDS.flexible_tolerance)
        if best is None or end.cost < best[1].cost:
            best = marginal, end
        if not end.effects:
            break
        moved = free.minimise(free.evaluate(on_base.values, end.effects), THRESHOLDS.free_eta_steps)
        if not moved.cost < (1.0 - THRESHOLDS.density_round_gain) * on_base.cost:
            break
        on_base = moved
    return on_base, best
