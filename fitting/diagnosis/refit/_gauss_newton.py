"""Joint refit of an operator and effects to whitened errors with priors, by damped Gauss-Newton."""

import dataclasses
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.diagnosis.noise._whitening import Whitener
from fitting.solver._damped_gauss_newton import (
    Damping,
    Linearisation,
    StoppingRule,
    minimise_damped,
)
from rapi_jax import ECDL

from ._base_model import BaseModel
from ._effect_vector import Effects, effect_values, free_parameters, with_values
from ._thresholds import THRESHOLDS
from ._whitened_model import WhitenedErrors, WhitenedModel, acts_before_operator
from .jacobian._effect_jacobian import secant_jacobian

# Least and greatest value of a parameter, by the effect's name and the parameter's path.
SearchRanges = dict[tuple[str, tuple[str | int, ...]], tuple[float, float]]


@dataclasses.dataclass(frozen=True, eq=False)
class State:
    """A point of a refit: parameter values, the errors of the model there, and their chi-square.

    - `values`: of the base model. `effects`: with their parameters.
    - `prior_cost`: chi-square of the priors, and `Refit.log_determinant`.
    - `operator_response`: see `WhitenedModel`.
    """

    values: Float[np.ndarray, " values"]
    effects: Effects
    errors: WhitenedErrors
    prior_cost: float
    operator_response: Float[Array, "runs nodes"]

    @property
    def synchronous(self) -> float:
        """Chi-square of scan-synchronous errors."""
        with np.errstate(over="ignore", invalid="ignore"):  # a step too far is no warning
            return float(self.errors.synchronous @ self.errors.synchronous)

    @property
    def nonsynchronous(self) -> float:
        """Chi-square of non-synchronous errors."""
        with np.errstate(over="ignore", invalid="ignore"):
            return float(self.errors.nonsynchronous @ self.errors.nonsynchronous)

    @property
    def cost(self) -> float:
        """Chi-square in all, with that of the priors and of moved jumps."""
        return (
            self.synchronous + self.nonsynchronous + self.prior_cost + self.errors.jump_timing_cost
        )

    def to_ecdl(self, whitened: WhitenedModel, base: BaseModel) -> ECDL:
        """The model of the laser with these values."""
        effects = jax.tree_util.tree_map(jnp.asarray, self.effects)
        return ECDL(whitened.set_values(base.operator, self.values), effects)


@dataclasses.dataclass(frozen=True, eq=False)
class Refit:
    """A least-squares problem: whitened errors of a recording, base model and bounds of effects.

    - `search_ranges`: bounds of effects' parameters that are narrower than the declared ones, by
      effect and parameter: not far beyond the initial guesses, where an effect is no longer what
      its name says (an etalon of two scans' width is a polynomial).
    - `log_determinant`: of the covariance of what a base misfits, if the whitener has one; it
      counts as cost, so that costs with other covariances compare as likelihoods do.
    - `freeze_jumps`: whether effects that jump keep their parameters, apart from a switch's size.
    - `hold_effects`: whether all effects keep all of theirs, and the base alone moves.
    """

    whitened: WhitenedModel
    whitener: Whitener
    base: BaseModel
    search_ranges: SearchRanges | None = None
    freeze_jumps: bool = False
    hold_effects: bool = False
    log_determinant: float = 0.0

    def evaluate(self, values: Float[np.ndarray, " values"], effects: Effects) -> State:
        """The state at given values of the base model and given effects.

        Of a response so large that the readings are lost in its rounding the cost is infinite: less
        its own mean it would seem to fit them exactly.
        """
        base = self.base
        response = self.whitened.operator_response(base.operator, values, effects)
        with np.errstate(invalid="ignore", over="ignore"):  # a step too far is no warning
            errors = self.whitened.evaluate_errors(self.whitener, effects, response)
        largest = max(float(np.abs(e).max()) for e in errors.raw)
        if largest > THRESHOLDS.lost_readings * self.whitened.span > 0.0:  # 0: nothing recorded
            lost = np.full_like(errors.synchronous, np.inf)
            errors = errors._replace(synchronous=lost)
        with np.errstate(invalid="ignore", over="ignore"):
            off = np.where(
                np.isfinite(base.prior_std), (values - base.prior_mean) / base.prior_std, 0.0
            )
        return State(values, effects, errors, float(off @ off) + self.log_determinant, response)

    def jacobian_effects(
        self, state: State, step_scale: float = 1.0
    ) -> Float[np.ndarray, "lines parameters"]:
        """Derivative of all whitened errors by each free parameter of the effects.

        By secants, `step_scale` times as wide as usual; 0 where effects are held.
        """
        if self.hold_effects:
            return np.zeros((state.errors.all.size, effect_values(state.effects).size))
        whitened, operator = self.whitened, self.base.operator

        def errors_with(effects: Effects) -> np.ndarray:
            response = state.operator_response
            pairs = zip(effects, state.effects, strict=True)
            if any(acts_before_operator(one) and one is not other for one, other in pairs):
                response = whitened.operator_response(operator, state.values, effects)
            return whitened.evaluate_errors(self.whitener, effects, response).all

        return secant_jacobian(
            errors_with,
            state.effects,
            state.errors.all,
            self.bounds(state.effects)[1],
            freeze_jumps=self.freeze_jumps,
            step_scale=step_scale,
        )

    def jacobian_base(self, state: State) -> Float[np.ndarray, "synchronous values"]:
        """Derivative of the synchronous errors by each value of the base model; 0 where fixed."""
        if not self.base.free.any():
            return np.zeros((state.errors.synchronous.size, state.values.size))
        operator = self.whitened.linearise_operator(self.base.operator, state.values, state.effects)
        columns = self.whitened.jacobian_operator(self.whitener, state.effects, operator)
        return columns * self.base.free[None, :]

    def normal_equations(
        self, state: State, step_scale: float = 1.0
    ) -> tuple[
        Float[np.ndarray, "unknowns unknowns"],
        Float[np.ndarray, " unknowns"],
        Float[np.ndarray, "lines parameters"],
    ]:
        """Normal matrix and gradient of half the cost, and the Jacobian of the effects.

        Unknowns are the values of the base model, then the parameters of the effects. `step_scale`:
        see `jacobian_effects`.
        """
        j = self.jacobian_base(state)
        s = self.jacobian_effects(state, step_scale)
        n, m, split = j.shape[1], s.shape[1], state.errors.synchronous.size
        matrix = np.zeros((n + m, n + m))
        top = np.concatenate([j, s[:split]], axis=1)
        matrix[:] = top.T @ top
        matrix[n:, n:] += s[split:].T @ s[split:]
        gradient = top.T @ state.errors.synchronous
        gradient[n:] += s[split:].T @ state.errors.nonsynchronous
        matrix[np.arange(n), np.arange(n)] += self.prior_weight
        gradient[:n] += self._prior_gradient(state)
        return matrix, gradient, s

    def _prior_gradient(self, state: State) -> Float[np.ndarray, " values"]:
        weight = self.prior_weight
        return weight * np.where(weight > 0, state.values - self.base.prior_mean, 0.0)

    def jacobian(self, state: State) -> Float[np.ndarray, "lines unknowns"]:
        """Derivative of all whitened errors by the base's values, then the effects' parameters."""
        base, effects = self.jacobian_base(state), self.jacobian_effects(state)
        out = np.zeros((len(effects), base.shape[1] + effects.shape[1]))
        out[: len(base), : base.shape[1]] = base
        out[:, base.shape[1] :] = effects
        return out

    @property
    def prior_weight(self) -> Float[np.ndarray, " values"]:
        """One over the variance of the prior of each value of the base; 0 where it is fixed."""
        weight = np.where(np.isfinite(self.base.prior_std), self.base.prior_std, np.inf) ** -2.0
        return np.where(self.base.free, weight, 0.0)

    def minimise(
        self,
        state: State,
        steps: int,
        tolerance: float | None = None,
        jacobian: Float[np.ndarray, "lines unknowns"] | None = None,
        least_gain: float = 0.0,
    ) -> State:
        """At most `steps` damped Gauss-Newton steps; ends where steps gain next to nothing.

        `tolerance`: of the excess over what noise alone would leave, below which a step counts as
        slow; `THRESHOLDS.relative_gain` by default. `least_gain`: of chi-square, below which one
        is slow in any case. `jacobian`: one for all steps, see `jacobian`.
        """
        limits = THRESHOLDS
        share = limits.relative_gain if tolerance is None else tolerance
        noise = float(self.whitener.used_lines)
        return minimise_damped(
            state,
            cost=lambda state: state.cost,
            linearise=self._linearise if jacobian is None else self._with_jacobian(jacobian),
            move=self.take_step,
            damping=Damping(
                initial=limits.initial_damping,
                decrease=limits.damping_decay,
                increase=limits.damping_growth,
                smallest=limits.least_damping,
                largest=limits.greatest_damping,
                attempts=limits.damping_trials if jacobian is None else limits.kept_trials,
                shares=limits.shorter_steps,
            ),
            stop=StoppingRule(
                negligible=lambda gain, cost: gain < limits.least_gain,
                slow=lambda gain, cost: gain < max(share * (cost - noise), least_gain),
                slow_steps=limits.slow_steps,
            ),
            max_steps=steps,
            narrow_secant=limits.narrow_step_scale,
        )

    def _linearise(self, state: State, step_scale: float) -> Linearisation:
        """The damped normal equations at `state`."""
        matrix, gradient, effects = self.normal_equations(state, step_scale)
        return Linearisation.of(
            matrix, gradient, self._room(state), uses_secants=bool(effects.any())
        )

    def _with_jacobian(
        self, jacobian: Float[np.ndarray, "lines unknowns"]
    ) -> Callable[[State, float], Linearisation]:
        """The same at any state, with one Jacobian for all."""
        n = self.base.free.size
        matrix = jacobian.T @ jacobian
        matrix[np.arange(n), np.arange(n)] += self.prior_weight

        def linearise(state: State, step_scale: float) -> Linearisation:
            gradient = jacobian.T @ state.errors.all
            gradient[:n] += self._prior_gradient(state)
            return Linearisation.of(matrix, gradient, self._room(state))

        return linearise

    def _room(
        self, state: State
    ) -> tuple[Float[np.ndarray, " unknowns"], Float[np.ndarray, " unknowns"]]:
        """How far each unknown may step down and up; the effects' not quite to a bound.

        There an effect may be none at all, and the other parameters then say nothing. The base's
        values are cut at theirs afterwards: its many weights come and go.
        """
        low, high = self.bounds(state.effects)
        now, share = effect_values(state.effects), THRESHOLDS.step_to_bound
        free = np.full(state.values.size, np.inf)
        least = np.concatenate([-free, share * (low - now)])
        most = np.concatenate([free, share * (high - now)])
        return np.minimum(least, 0.0), np.maximum(most, 0.0)

    def bounds(
        self, effects: Effects
    ) -> tuple[Float[np.ndarray, " parameters"], Float[np.ndarray, " parameters"]]:
        """Lowest and highest value of each free parameter of `effects`."""
        ranges = self.search_ranges or {}
        pairs = [
            ranges.get((e.name, p.path), (p.low, p.high))
            for e in effects
            for p in free_parameters(e)
        ]
        low, high = np.array(pairs, dtype=float).reshape(-1, 2).T
        return low, high

    def take_step(self, state: State, step: Float[np.ndarray, " unknowns"]) -> State:
        """The state one step away, within bounds."""
        n = state.values.size
        values = np.clip(state.values + step[:n], self.base.lower, self.base.upper)
        effects = state.effects
        if effects:
            now = effect_values(effects)
            low, high = self.bounds(effects)
            # A parameter that would pass a bound goes half the way there.
            new = now + step[n:]
            new = np.where(
                new < low, (now + low) / 2.0, np.where(new > high, (now + high) / 2.0, new)
            )
            effects = with_values(effects, np.where(np.isfinite(new), new, now))
        return self.evaluate(values, effects)
