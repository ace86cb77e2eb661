"""Joint refits of an operator and the effects around it, to whitened errors with priors.

Damped Gauss-Newton steps on the normal equations. Candidates are compared by many short refits of
models of different make: a general solver would be compiled for each, and compiling takes longer
than the refit.
"""

import dataclasses
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fitting.diagnosis.noise._spectrum import Whitener
from rapi_jax import ECDL, AbstractOperator
from rapi_jax._parameter import parameters
from rapi_jax.effects import (
    AbstractCouplingEffect,
    AbstractEffect,
    AbstractOpticalEffect,
    AbstractSwitch,
)

from ._effect_vector import Effects, effect_values, free_parameters, with_values
from ._whitened_model import Errors, WhitenedModel

Reach = dict[tuple[str, tuple[str | int, ...]], tuple[float, float]]
# Of a parameter's size, to move an effect by: before a play, or where a response jumps, the change
# must be larger than a kink; elsewhere small, since a line's phase turns fast over a session.
_STEP, _FINE = 3e-3, 1e-6
_NARROW = 0.03  # of a secant, where no step along the wide ones leads down
_TRIES = 9  # each with 12 times the damping of the one before
_SMALL = 0.05  # fall of chi-square below which a descent is over


@dataclasses.dataclass(frozen=True, eq=False)
class Base:
    """An operator whose values are fitted, and how far each may go.

    `prior`: standard deviation of each value about `centre`; infinite where there is none.
    """

    operator: AbstractOperator
    centre: np.ndarray
    prior: np.ndarray
    low: np.ndarray
    high: np.ndarray
    free: np.ndarray

    @classmethod
    def of(
        cls, whitened: WhitenedModel, operator: AbstractOperator, free: np.ndarray | None = None
    ) -> "Base":
        """Bounds as declared, no prior; `free`: which of the operator's values may move."""
        found = parameters(operator)
        values = np.concatenate([np.asarray(getattr(operator, p.name)).ravel() for p in found])
        low = np.concatenate([np.full(p.size, p.bounds[0]) for p in found])
        high = np.concatenate([np.full(p.size, p.bounds[1]) for p in found])
        # Thresholds of all runs stay positive with a growth that is a little negative.
        low = np.where(values < low, 2.0 * values, low)
        extra = whitened.fractions(operator.count)
        values = np.concatenate([values, np.full(extra, 0.5)])
        low, high = np.append(low, np.zeros(extra)), np.append(high, np.ones(extra))
        move = np.ones(values.size, dtype=bool)
        if free is not None:
            move[: free.size] = free
        return cls(operator, values, np.full(values.size, np.inf), low, high, move)

    def without(self, *names: str) -> "Base":
        """The same with the fields of these names held."""
        free, at = self.free.copy(), 0
        for p in parameters(self.operator):
            free[at : at + p.size] &= p.name not in names
            at += p.size
        return dataclasses.replace(self, free=free)


@dataclasses.dataclass(frozen=True, eq=False)
class State:
    """Where a refit stands: values, effects, errors there, and the sums of squares."""

    values: np.ndarray
    effects: Effects
    errors: Errors
    prior: float
    nodes: Any

    @property
    def synchronous(self) -> float:
        """Chi-square of what repeats with the scan."""
        with np.errstate(over="ignore", invalid="ignore"):  # a step too far is no warning
            return float(self.errors.synchronous @ self.errors.synchronous)

    @property
    def nonsynchronous(self) -> float:
        """Chi-square of what does not."""
        with np.errstate(over="ignore", invalid="ignore"):
            return float(self.errors.nonsynchronous @ self.errors.nonsynchronous)

    @property
    def cost(self) -> float:
        """All of it."""
        return self.synchronous + self.nonsynchronous + self.prior + self.errors.jump_timing_cost

    def ecdl(self, whitened: WhitenedModel, base: Base) -> ECDL:
        """The model."""
        effects = jax.tree_util.tree_map(jnp.asarray, self.effects)
        return ECDL(whitened.filled(base.operator, self.values), effects)


@dataclasses.dataclass(frozen=True, eq=False)
class Refit:
    """What a refit needs besides its start.

    `reach`: how far parameters of effects may go, by effect and parameter: not far beyond the
    trials, where an effect is no longer what its name says (an etalon of two scans' width is a
    polynomial).
    """

    whitened: WhitenedModel
    whitener: Whitener
    base: Base
    reach: Reach | None = None
    still: bool = False  # whether what jumps stays as it is, but for its size

    def at(self, values: np.ndarray, effects: Effects) -> State:
        """The state at given values."""
        base = self.base
        nodes = self.whitened.nodes(base.operator, values, effects)
        errors = self.whitened.errors(self.whitener, effects, nodes)
        with np.errstate(invalid="ignore", over="ignore"):
            off = np.where(np.isfinite(base.prior), (values - base.centre) / base.prior, 0.0)
        return State(values, effects, errors, float(off @ off), nodes)

    def effect_columns(self, state: State, share: float = 1.0) -> np.ndarray:
        """Derivative of locked and loose errors by each moved parameter of the effects.

        By secants, `share` times as wide as usual.
        """
        return _effect_columns(self, state, share)

    def base_columns(self, state: State) -> np.ndarray:
        """Derivative of the locked errors by each value of the operator."""
        nodes, moved = self.whitened.moved(self.base.operator, state.values, state.effects)
        columns = self.whitened.columns(self.whitener, state.effects, nodes, moved)
        return columns * self.base.free[None, :]

    def gram(self, state: State, share: float = 1.0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Normal matrix, gradient, and the effects' columns, over values then parameters.

        `share`: see `effect_columns`.
        """
        j = self.base_columns(state)
        s = self.effect_columns(state, share)
        n, m, split = j.shape[1], s.shape[1], state.errors.synchronous.size
        full = np.zeros((n + m, n + m))
        top = np.concatenate([j, s[:split]], axis=1)
        full[:] = top.T @ top
        full[n:, n:] += s[split:].T @ s[split:]
        gradient = top.T @ state.errors.synchronous
        gradient[n:] += s[split:].T @ state.errors.nonsynchronous
        weight = np.where(np.isfinite(self.base.prior), self.base.prior, np.inf) ** -2.0
        weight = np.where(self.base.free, weight, 0.0)
        full[np.arange(n), np.arange(n)] += weight
        gradient[:n] += weight * np.where(weight > 0, state.values - self.base.centre, 0.0)
        return full, gradient, s

    def descend(self, state: State, steps: int, share: float = 1e-4) -> State:
        """At most `steps` damped steps; ends where one takes away next to nothing.

        `share`: of the excess over what noise alone would leave, below which a fall is next to
        nothing, twice in a row.
        """
        damping, slow, wide = 1e-4, 0, 1.0
        noise = float(state.errors.synchronous.size + state.errors.nonsynchronous.size)
        for _ in range(steps):
            full, gradient, columns = self.gram(state, wide)
            length = np.sqrt(np.diag(full))
            alive = length > 0
            unit = np.where(alive, length, 1.0)
            scaled = full / unit[:, None] / unit[None, :]
            best = None
            for _ in range(_TRIES):
                matrix = scaled + damping * np.eye(unit.size) + np.diag(np.where(alive, 0.0, 1.0))
                move = -np.linalg.solve(matrix, np.where(alive, gradient / unit, 0.0)) / unit
                new = self._moved(state, np.where(alive, move, 0.0))
                if np.isfinite(new.cost) and new.cost < state.cost:
                    best = new
                    damping = max(damping / 8.0, 1e-9)
                    break
                damping = min(damping * 12.0, 1e4)
            if best is None:
                if wide < 1.0 or not columns.any():
                    return state
                damping, wide = 1e-4, _NARROW  # a kink may be nearer than a secant is wide
                continue
            gain = state.cost - best.cost
            state = best
            slow = slow + 1 if gain < share * max(state.cost - noise, 0.0) else 0
            if gain < _SMALL or slow == 2:
                return state
        return state

    def edges(self, effects: Effects) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest value of each moved parameter of `effects`."""
        reach = self.reach or {}
        edges = [
            reach.get((e.name, p.path), (p.low, p.high))
            for e in effects
            for p in free_parameters(e)
        ]
        low, high = np.array(edges, dtype=float).reshape(-1, 2).T
        return low, high

    def _moved(self, state: State, move: np.ndarray) -> State:
        n = state.values.size
        values = np.clip(state.values + move[:n], self.base.low, self.base.high)
        effects = state.effects
        if effects:
            now = effect_values(effects)
            low, high = self.edges(effects)
            # A parameter that would jump beyond a bound goes half the way there.
            new = now + move[n:]
            new = np.where(
                new < low, (now + low) / 2.0, np.where(new > high, (now + high) / 2.0, new)
            )
            effects = with_values(effects, np.where(np.isfinite(new), new, now))
        return self.at(values, effects)


def _effect_columns(refit: Refit, state: State, share: float) -> np.ndarray:
    total = state.errors.synchronous.size + state.errors.nonsynchronous.size
    now = effect_values(state.effects)
    columns = np.zeros((total, now.size))
    moves = [p for e in state.effects for p in _moves(e, refit.still)]
    low, high = refit.edges(state.effects)
    behind = (AbstractOpticalEffect, AbstractCouplingEffect)
    steps = [
        _FINE if type(e).smooth and isinstance(e, behind) else _STEP
        for e in state.effects
        for _ in free_parameters(e)
    ]
    here = np.concatenate([state.errors.synchronous, state.errors.nonsynchronous])
    for i in np.flatnonzero(moves).tolist():
        value = now[i]
        step = share * steps[i] * max(abs(value), _least(state.effects, i))
        if value + step > high[i]:
            step = -step
        other = now.copy()
        other[i] = value + step
        effects = with_values(state.effects, other)
        whitened, whitener, base = refit.whitened, refit.whitener, refit.base
        ahead = whitened.ahead(effects) != ()
        nodes = whitened.nodes(base.operator, state.values, effects) if ahead else state.nodes
        errors = whitened.errors(whitener, effects, nodes)
        columns[:, i] = (np.concatenate([errors.synchronous, errors.nonsynchronous]) - here) / step
    return columns


def _moves(effect: AbstractEffect, still: bool) -> list[bool]:
    """Which of an effect's parameters a descent moves."""
    every, switch = type(effect).smooth or not still, isinstance(effect, AbstractSwitch)
    return [every or (switch and p.path == ("size",)) for p in free_parameters(effect)]


def _least(effects: Effects, index: int) -> float:
    """Size to take for a parameter that is zero: a hundredth of what its bounds allow, or one."""
    low, high = [(p.low, p.high) for e in effects for p in free_parameters(e)][index]
    return (high - low) / 100.0 if np.isfinite(high - low) else 1e-3
