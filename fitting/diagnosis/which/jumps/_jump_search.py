"""Derivative-free search over parameters of effects that jump: by coordinates, then by a simplex.

Chi-square is piecewise constant in the position of a jump between two samples, so that its
derivative says nothing.
"""

import numpy as np
from scipy.optimize import minimize

from fitting.diagnosis.refit._effect_vector import (
    Effects,
    effect_values,
    free_parameters,
    with_values,
)
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._effect_sets import acts_on_drive
from rapi_jax.effects import AbstractEffect

from ._thresholds import THRESHOLDS

_REFUSED = 1e300  # cost of a point that is out of bounds or not finite


def search_jump_parameters(refit: Refit, state: State, cost_without: float) -> State:
    """The best state that a pattern search over the parameters of effects that jump finds.

    One parameter at a time by shrinking steps; then all together, unless too much is left for
    exact positions to matter. What changes the drive before it jumps moves the jumps as well.
    `cost_without`: chi-square without the effect.
    """
    jumping = [
        moves
        for k, effect in enumerate(state.effects)
        for moves in len(free_parameters(effect)) * [_moves_jumps(effect, state.effects[k:])]
    ]
    low, high = refit.bounds(state.effects)
    for step in THRESHOLDS.pattern_steps:
        for i in np.flatnonzero(jumping):
            now = effect_values(state.effects)
            size = abs(now[i]) if now[i] else THRESHOLDS.zero_parameter_size
            for sign in (1.0, -1.0):
                trial = now.copy()
                trial[i] += sign * step * size
                if not low[i] <= trial[i] <= high[i]:
                    continue
                new = refit.evaluate(state.values, with_values(state.effects, trial))
                if np.isfinite(new.cost) and new.cost < state.cost:
                    state = new
                    break
    noise = state.errors.synchronous.size + state.errors.nonsynchronous.size
    if state.cost - noise > THRESHOLDS.simplex_excess * (cost_without - noise):
        return state
    return _search_by_simplex(refit, state, np.flatnonzero(jumping))


def _moves_jumps(effect: AbstractEffect, onward: Effects) -> bool:
    """Whether an effect jumps, or changes the drive before one of those behind it jumps."""
    return not type(effect).smooth or (
        acts_on_drive(effect) and any(acts_on_drive(e) and not type(e).smooth for e in onward)
    )


def _search_by_simplex(refit: Refit, state: State, searched: np.ndarray) -> State:
    """The parameters at `searched` together: valleys across the coordinates are narrow.

    A jump up and its jump down both stay in place only where width and threshold move together.
    """
    if searched.size < 2:
        return state
    best, now = state, effect_values(state.effects)
    low, high = refit.bounds(state.effects)
    size = np.where(now[searched] != 0.0, np.abs(now[searched]), THRESHOLDS.zero_parameter_size)

    def cost(x: np.ndarray) -> float:
        nonlocal best
        trial = now.copy()
        trial[searched] += x * size
        if (trial < low).any() or (trial > high).any():
            return _REFUSED
        new = refit.evaluate(state.values, with_values(state.effects, trial))
        if np.isfinite(new.cost) and new.cost < best.cost:
            best = new
        return new.cost if np.isfinite(new.cost) else _REFUSED

    count = searched.size
    options = {
        "maxfev": THRESHOLDS.simplex_evaluations * count,
        "xatol": THRESHOLDS.simplex_tolerance,
    }
    for width in THRESHOLDS.simplex_widths:
        start = (effect_values(best.effects) - now)[searched] / size
        corners = start + width * np.concatenate([np.zeros((1, count)), np.eye(count)])
        minimize(cost, start, method="Nelder-Mead", options=options | {"initial_simplex": corners})
    return best
