"""Refits of effects on the flexible base: a density of plays, integrated out in closed form.

Plays are linear in their weights, so nothing is searched but the effects' few parameters. Without a
measured noise a density has no scale: then an operator with many plays is searched.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._effect_vector import Effects
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._thresholds import THRESHOLDS

from ._flexible_refit import (
    follows_drive,
    refit_and_search,
    refit_flexible_operator,
    refit_from_either,
)


def refit_on_flexible_base(
    free: Refit, on_base: State, without: Candidate | None = None
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on the flexible base: a density where noise is measured.

    `free`: with all of the operator free. `without`: lacks the further effect. Elsewhere an
    operator that is searched; without an effect it has to follow the drive. Where it draws a lag
    instead, it would beside every effect: the identified base is then the flexible one, too. See
    `refit_on_density`.
    """
    if free.whitener.spectrum.measured:
        most = on_base.cost if without is None else without.cost
        return refit_on_density(free, on_base.values, on_base.effects, most)
    if without is None:
        flexible, end = refit_flexible_operator(free, on_base)
        hysteresis = follows_drive(flexible, end)
        return (on_base, flexible, end) if hysteresis else (on_base, free, on_base)
    if without.flexible_refit is without.refit:
        return on_base, free, on_base
    lacking = without.flexible_refit, without.on_flexible_base
    return (on_base, *refit_from_either(free, on_base, lacking))


def nearest_base(
    free: Refit, bases: Sequence[Float[np.ndarray, " values"]], effects: Effects
) -> Float[np.ndarray, " values"]:
    """Of the values of several bases those that a short refit beside `effects` leaves least from.

    The effects are held. `free`: with all of the operator free.
    """
    held = dataclasses.replace(free, hold_effects=True)
    begins = [held.evaluate(values, effects) for values in bases]
    ends = [
        held.minimise(state, THRESHOLDS.short_steps) for state in begins if np.isfinite(state.cost)
    ]
    return min(ends, key=lambda state: state.cost).values if ends else bases[0]


def refit_on_density(
    free: Refit,
    values: Float[np.ndarray, " values"],
    effects: Effects,
    cost_without: float = np.inf,
) -> tuple[State, Refit, State]:
    """The refit on the base, and that on a density about it: the base and the effects in turn.

    The base is fitted beside effects that are held, and these with the base and the plays' weights
    integrated out; last both together on the base, about which the density is taken once more.
    Fitted together from the first the effects would follow what the base misfits; in turn alone
    they creep along what the two share. Of all these densities the one that leaves least is the
    result. `free`: with all of the operator free; `values`, `effects`: where it begins.
    `cost_without`: chi-square on the density without the further effect.
    """
    steps = THRESHOLDS.free_eta_steps
    tolerance = THRESHOLDS.density_tolerance if effects else None
    least = 1.0 - THRESHOLDS.density_round_gain
    held = dataclasses.replace(free, hold_effects=True)
    base = held.minimise(held.evaluate(values, effects), steps, tolerance)
    best = _refit_about(free, base, base.effects, cost_without)
    if not effects:
        return (base, *best)
    for _ in range(THRESHOLDS.density_rounds - 1):
        moved = held.minimise(held.evaluate(base.values, best[1].effects), steps, tolerance)
        if not moved.cost < least * base.cost:
            break
        base = moved
        best = min(best, _refit_about(free, base, best[1].effects, cost_without), key=_cost)
    together = free.minimise(free.evaluate(base.values, best[1].effects), steps, tolerance)
    if together.cost < least * base.cost:
        best = min(best, _refit_about(free, together, together.effects, cost_without), key=_cost)
    return (together, *best)


def refit_about_or_on_density(
    free: Refit, marginal: Refit, start: State, none: Candidate
) -> tuple[State, Refit, State]:
    """`refit_on_density` from `start`, or the density it is on, `marginal`, where that leaves less.

    A base that is refitted beside effects which are far off follows what they leave, and may end
    where a density about it leaves more than one about the base without them. `none`: without
    further effects.
    """
    on_base, refit, end = refit_on_density(free, start.values, start.effects, none.cost)
    near = refit_and_search(marginal, start, none.cost)
    if near.cost < end.cost and is_near_base(free, near, none):
        return on_base, marginal, near
    return on_base, refit, end


def is_near_base(free: Refit, state: State, none: Candidate) -> bool:
    """Whether effects leave the response so much as it is that a base integrated out tells of them.

    What another base would change is taken to first order, as it is without them: a drive that is
    held at rest would leave all of the response to that, at no cost.
    """
    there = free.evaluate(state.values, state.effects)
    return bool(there.cost < THRESHOLDS.far_from_base * none.on_base.cost)


def _refit_about(
    free: Refit, base: State, effects: Effects, cost_without: float
) -> tuple[Refit, State]:
    """`effects` refitted on a density about `base`."""
    marginal = FlexibleBase.about(free, base).marginal
    return marginal, refit_and_search(
        marginal, marginal.evaluate(base.values, effects), cost_without
    )


def _cost(refitted: tuple[Refit, State]) -> float:
    return refitted[1].cost
