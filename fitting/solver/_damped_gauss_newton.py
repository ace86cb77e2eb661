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
from jaxtyping import Float

from ._bounded_step import bounded_step

State = TypeVar("State")


@dataclasses.dataclass(frozen=True)
class Damping:
    """How the damping of a step changes: relative to the normal matrix's diagonal."""

    initial: float
    decrease: float  # divisor after a step that lowers the cost
    increase: float  # factor after one that does not
    smallest: float
    largest: float
    attempts: int  # dampings tried from one linearisation
    shares: tuple[float, ...] = ()  # of a step that does not lower the cost, tried before more


@dataclasses.dataclass(frozen=True)
class Linearisation:
    """The normal equations at one state.

    `step(damping)` solves them. `uses_secants`: whether a narrower secant would give others.
    `decrease(step)`: of the cost, as they foresee it; where it is not given all steps are tried.
    """

    step: Callable[[float], np.ndarray]
    uses_secants: bool = False
    decrease: Callable[[np.ndarray], float] = lambda step: np.inf

    @classmethod
    def of(
        cls,
        matrix: Float[np.ndarray, "unknowns unknowns"],
        gradient: Float[np.ndarray, " unknowns"],
        room: tuple[Float[np.ndarray, " unknowns"], Float[np.ndarray, " unknowns"]],
        *,
        uses_secants: bool = False,
    ) -> "Linearisation":
        """Those of half the cost, with columns of unit length.

        `room`: how far each unknown may step down (not above 0) and up.
        """
        length = np.sqrt(np.diag(matrix))
        alive = length > 0
        unit = np.where(alive, length, 1.0)
        scaled = matrix / unit[:, None] / unit[None, :]
        pull = np.where(alive, gradient / unit, 0.0)
        least, most = (np.where(alive, side * unit, 0.0) for side in room)

        def step(damping: float) -> np.ndarray:
            damped = scaled + damping * np.eye(unit.size) + np.diag(np.where(alive, 0.0, 1.0))
            return np.where(alive, bounded_step(damped, pull, least, most) / unit, 0.0)

        def decrease(step: np.ndarray) -> float:
            return float(-step @ (2.0 * gradient + matrix @ step))

        return cls(step, uses_secants, decrease)


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
        for _ in range(damping.attempts):
            step = equations.step(level)
            if stop.is_idle(equations.decrease(step), lowest):  # more damping foresees even less
                trial, reached = state, np.inf
                break
            trial, reached = _shortened(step, (1.0, *damping.shares), state, move, cost, lowest)
            if reached < lowest:
                break
            level = min(level * damping.increase, damping.largest)
        if not reached < lowest:
            if width <= narrow_secant or not equations.uses_secants:
                return state
            level, width = damping.initial, narrow_secant
            continue
        level = max(level / damping.decrease, damping.smallest)
        decrease, lowest, state = lowest - reached, reached, trial
        slow_steps = slow_steps + 1 if stop.slow(decrease, lowest) else 0
        if stop.negligible(decrease, lowest) or slow_steps == stop.slow_steps:
            return state
    return state


def _shortened(
    step: np.ndarray,
    shares: tuple[float, ...],
    state: State,
    move: Callable[[State, np.ndarray], State],
    cost: Callable[[State], float],
    lowest: float,
) -> tuple[State, float]:
    """The first of the shortened steps that lowers the cost, or the last, and its cost.

    Along a curved valley the undamped direction is right, and only too long; damping turns it to
    the valley's walls.
    """
    trial, reached = state, np.inf
    for share in shares:
        trial = move(state, share * step)
        found = cost(trial)
        reached = found if np.isfinite(found) else np.inf
        if reached < lowest:
            break
    return trial, reached
