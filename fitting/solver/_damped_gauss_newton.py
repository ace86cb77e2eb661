"""Damped Gauss-Newton minimisation on the host, for models whose structure changes between fits.

`_least_squares` compiles its whole iteration for each structure of residual. Where many short fits
of differently built models are compared, compiling would take longer than fitting; and columns of
effects that jump are secants whose width has to shrink on the way, which no compiled derivative
offers. So the caller evaluates cost and linearisation, and only the iteration stands here.
"""

import dataclasses
from collections.abc import Callable
from typing import TypeVar

import numpy as np

State = TypeVar("State")


@dataclasses.dataclass(frozen=True)
class Damping:
    """How the damping of a step changes: relative to the normal matrix's diagonal.

    By the ratio of what a step gained to what was foreseen: where it is near 1 damping falls, by
    `decrease` at most; where it is small it stays or rises. Each trial that fails multiplies it by
    `increase`, the next by twice that, and so on (Nielsen, IMM-REP-1999-05).
    """

    initial: float
    decrease: float
    increase: float
    smallest: float
    largest: float
    attempts: int  # dampings tried from one linearisation

    def after_success(self, level: float, gain_ratio: float) -> float:
        """The damping after a step that lowered the cost."""
        factor = max(1.0 / self.decrease, 1.0 - (2.0 * gain_ratio - 1.0) ** 3)
        return min(max(level * factor, self.smallest), self.largest)

    def after_failure(self, level: float, failed: int) -> float:
        """The damping after a trial that did not, `failed` trials before it likewise."""
        return min(level * self.increase * 2.0**failed, self.largest)


@dataclasses.dataclass(frozen=True)
class Linearisation:
    """The normal equations at one state.

    `step(damping)` solves them. `uses_secants`: whether a narrower secant would give others.
    `decrease(step)`: of the cost, as they foresee it; where it is not given all steps are tried,
    and what they gain counts as foreseen.
    """

    step: Callable[[float], np.ndarray]
    uses_secants: bool = False
    decrease: Callable[[np.ndarray], float] = lambda step: np.inf


@dataclasses.dataclass(frozen=True)
class StoppingRule:
    """When a decrease of the cost ends the iteration; both are called with (decrease, cost).

    `negligible` ends it at once, `slow` when true of `slow_steps` in a row. A step of which no more
    than that is foreseen is not tried.
    """

    negligible: Callable[[float, float], bool]
    slow: Callable[[float, float], bool] = lambda decrease, cost: False
    slow_steps: int = 2

    def is_idle(self, foreseen: float, cost: float) -> bool:
        """Whether a step with that decrease is not worth trying; never where it is infinite."""
        if np.isinf(foreseen):
            return False
        return self.negligible(foreseen, cost) or self.slow(foreseen, cost)


def minimise_damped(
    start: State,
    *,
    cost: Callable[[State], float],
    linearise: Callable[[State, float], Linearisation],
    move: Callable[[State, np.ndarray], State],
    damping: Damping,
    stop: StoppingRule,
    max_steps: int,
    narrow_secant: float = 1.0,
) -> State:
    """The state after at most `max_steps` damped Gauss-Newton steps; its cost never rises.

    **Arguments:**

    - `linearise`: the normal equations at a state, by secants so many times their usual width.
    - `move`: the state moved by a step, inside its bounds.
    - `narrow_secant`: the width to go on with, once, where no step along secants of the usual width
      lowers the cost: a kink may be nearer than a secant is wide.
    """
    state, lowest = start, cost(start)
    level, width, slow_steps = damping.initial, 1.0, 0
    for _ in range(max_steps):
        equations = linearise(state, width)
        trial, reached, foreseen = state, np.inf, np.inf
        for failed in range(damping.attempts):
            step = equations.step(level)
            foreseen = equations.decrease(step)
            if stop.is_idle(foreseen, lowest):  # more damping foresees even less
                break
            trial = move(state, step)
            reached = cost(trial)
            if reached < lowest:
                break
            level = damping.after_failure(level, failed)
        if not reached < lowest:
            if width <= narrow_secant or not equations.uses_secants:
                return state
            level, width = damping.initial, narrow_secant
            continue
        decrease, lowest, state = lowest - reached, reached, trial
        level = damping.after_success(level, _gain_ratio(decrease, foreseen))
        slow_steps = slow_steps + 1 if stop.slow(decrease, lowest) else 0
        if stop.negligible(decrease, lowest) or slow_steps == stop.slow_steps:
            return state
    return state


def _gain_ratio(decrease: float, foreseen: float) -> float:
    return decrease / foreseen if np.isfinite(foreseen) and foreseen > 0.0 else 1.0
