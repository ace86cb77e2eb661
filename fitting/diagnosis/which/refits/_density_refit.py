"""Refits of effects on the flexible base: a density of plays, integrated out in closed form.

Plays are linear in their weights, so nothing is searched but the effects' few parameters. Without a
measured noise a density has no scale: then an operator with many plays is searched.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._thresholds import THRESHOLDS

from ._flexible_refit import refit_and_search, refit_flexible_operator, refit_from_either


def refit_on_flexible_base(
    free: Refit, on_base: State, without: Candidate | None = None
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on the flexible base: a density where noise is measured.

    `free`: with all of the operator free. `without`: lacks the further effect. Elsewhere an
    operator that is searched. See `refit_on_density`.
    """
    if free.whitener.spectrum.measured:
        most = on_base.cost if without is None else without.cost
        return refit_on_density(free, on_base.values, on_base.effects, most)
    if without is None:
        return (on_base, *refit_flexible_operator(free, on_base))
    lacking = without.flexible_refit, without.on_flexible_base
    return (on_base, *refit_from_either(free, on_base, lacking))


def refit_on_density(
    free: Refit,
    values: Float[np.ndarray, " values"],
    effects: Effects,
    cost_without: float = np.inf,
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on a density about it: the base and the effects in turn.

    The base is fitted beside effects that are held, and these with the base and the plays' weights
    integrated out. Fitted together the effects would follow what the base misfits. `free`: with all
    of the operator free; `values`, `effects`: where it begins. `cost_without`: chi-square on the
    density without the further effect.
    """
    steps = THRESHOLDS.free_eta_steps
    held = dataclasses.replace(free, hold_effects=True)
    base = held.minimise(held.evaluate(values, effects), steps)
    marginal = FlexibleBase.about(free, base).marginal
    best = refit_and_search(marginal, marginal.evaluate(base.values, effects), cost_without)
    for _ in range(THRESHOLDS.density_rounds - 1 if effects else 0):
        moved = held.minimise(held.evaluate(base.values, best.effects), steps)
        if not moved.cost < (1.0 - THRESHOLDS.density_round_gain) * base.cost:
            break
        base = moved
        about = FlexibleBase.about(free, base).marginal
        end = refit_and_search(about, about.evaluate(base.values, best.effects), cost_without)
        if end.cost < best.cost:
            marginal, best = about, end
    together = free.evaluate(base.values, best.effects)
    return free.minimise(together, steps), marginal, best
