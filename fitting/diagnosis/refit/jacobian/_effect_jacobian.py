"""Jacobian of whitened errors by the parameters of effects, by secants of physical size.

A play has no useful derivative where a turning point passes a sample, and a response that jumps has
none at all. The step of a secant is chosen by what the effect acts on.
"""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.refit._effect_vector import (
    Effects,
    effect_values,
    free_parameters,
    with_values,
)
from fitting.diagnosis.refit._thresholds import THRESHOLDS
from rapi_jax.effects import (
    AbstractCouplingEffect,
    AbstractEffect,
    AbstractOpticalEffect,
    AbstractSwitch,
)


def secant_jacobian(
    errors_with: Callable[[Effects], Float[np.ndarray, " lines"]],
    effects: Effects,
    errors: Float[np.ndarray, " lines"],
    upper: Float[np.ndarray, " parameters"],
    *,
    freeze_jumps: bool = False,
    step_scale: float = 1.0,
) -> Float[np.ndarray, "lines parameters"]:
    """Derivative of `errors`, those of `effects`, by each free parameter of the effects.

    `errors_with`: the errors of other values. `upper`: bounds; a step that would pass one goes
    down instead. `freeze_jumps`: see `Refit`; columns of frozen parameters are zero. `step_scale`:
    factor on the usual steps.
    """
    now = effect_values(effects)
    columns = np.zeros((errors.size, now.size))
    moves = [move for e in effects for move in _movable(e, freeze_jumps)]
    steps = [step for e in effects for step in _relative_steps(e)]
    for i in np.flatnonzero(moves).tolist():
        step = step_scale * steps[i] * max(abs(now[i]), _size_at_zero(effects, i))
        if now[i] + step > upper[i]:
            step = -step
        other = now.copy()
        other[i] = now[i] + step
        columns[:, i] = (errors_with(with_values(effects, other)) - errors) / step
    return columns


def _relative_steps(effect: AbstractEffect) -> list[float]:
    behind = isinstance(effect, AbstractOpticalEffect | AbstractCouplingEffect)
    fine = type(effect).smooth and behind
    step = THRESHOLDS.fine_step if fine else THRESHOLDS.secant_step
    return [step for _ in free_parameters(effect)]


def _movable(effect: AbstractEffect, freeze_jumps: bool) -> list[bool]:
    """Which of an effect's parameters may move; of a frozen switch its size alone."""
    every, switch = type(effect).smooth or not freeze_jumps, isinstance(effect, AbstractSwitch)
    return [every or (switch and p.path == ("size",)) for p in free_parameters(effect)]


def _size_at_zero(effects: Effects, index: int) -> float:
    """Size to take for a parameter that is zero."""
    low, high = [(p.low, p.high) for e in effects for p in free_parameters(e)][index]
    width = high - low
    return width / THRESHOLDS.zero_range_parts if np.isfinite(width) else THRESHOLDS.unbounded_size
