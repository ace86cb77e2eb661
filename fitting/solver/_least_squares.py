"""Nonlinear least squares on `optimistix.LevenbergMarquardt`: scaled, bounded, verified at the end.

The solver runs in stages. Each stage measures coordinates so that every column of the Jacobian has
the same length, and residuals so that they have length one; both are taken afresh where the last
stage ended, and the trust region is carried over. So the tolerances mean the same for every model
and unit, and a stage that the solver calls finished too early is simply continued. Whether the end
is an optimum is decided from the gradient there, never from the solver's own flag. A descent that
comes to rest far from any optimum got there by too long a first step: it is repeated from the start
with a shorter one.
"""

import dataclasses
from collections.abc import Callable
from functools import cached_property
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array

from rapi_jax.internal import float64

from ._bound_transform import Bounds
from ._identifiability import inverse_gram, qr_factor, scale_columns, singular_directions
from ._normal_equations import NormalEquations
from ._promised_decrease import StopByPromise
from ._quick_compilation import quick_jit
from ._thresholds import THRESHOLDS

Residual = Callable[[Array, Any], Array]  # (values, args) -> residuals
_EPS = float(np.finfo(float).eps)


@dataclasses.dataclass(frozen=True)
class SolverOptions:
    """How far a fit is driven.

    `tolerance`: the solver's relative and absolute tolerance in scaled coordinates. `slope`: the
    cosine between residuals and Jacobian below which the end counts as an optimum. `max_steps`: the
    limit of steps over all attempts, checked after each stage; a curved valley may take thousands.
    `promise`: the share of the cost that the next step must promise for the solver to take it.
    """

    tolerance: float = 1e-8
    slope: float = 1e-7
    max_steps: int = 20_000
    promise: float = 0.0


DEFAULTS = SolverOptions()


def _residual(residual: Residual, bounds: Bounds, x: Array, args: Any) -> Array:
    return residual(bounds.values(x), args)


def _linearise(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, Array]:
    """Residuals and their Jacobian with respect to the unbounded coordinates."""
    value, push = jax.linearize(lambda x: _residual(residual, bounds, x, args), x)
    return value, jax.vmap(push, out_axes=1)(jnp.eye(x.size))


linearise = quick_jit(_linearise)


@quick_jit
def _evaluate(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, ...]:
    """Residuals at `x` and their Jacobian, then the values there and theirs."""
    return *_linearise(residual, bounds, x, args), *bounds.linearise(x)


def _stage_residual(z: Array, args: Any) -> Array:
    residual, bounds, center, basis, unit, inner = args
    return _residual(residual, bounds, center + basis @ z, inner) / unit


@quick_jit
def _stage(residual, bounds, center, basis, unit, args, tolerance, promise):
    solver = optx.LevenbergMarquardt(
        rtol=tolerance, atol=tolerance, linear_solver=NormalEquations()
    )
    search = optx.ClassicalTrustRegion(high_cutoff=THRESHOLDS.region_growth)
    solver = eqx.tree_at(lambda s: s.search, solver, search)
    solver = StopByPromise(solver, promise)
    solution = optx.least_squares(
        _stage_residual,
        solver,
        jnp.zeros_like(center),
        (residual, bounds, center, basis, unit, args),
        max_steps=THRESHOLDS.stage_steps,
        throw=False,
    )
    # The damping, 1 / step size, is relative to squared column lengths.
    stretch = jnp.sqrt(solution.state.inner.search_state.step_size)
    small = solution.state.small
    return center + basis @ solution.value, solution.stats["num_steps"], stretch, small


@dataclasses.dataclass(frozen=True, eq=False)
class LeastSquares:
    """The end of a fit: values, residuals, Jacobian, and whether it is an optimum.

    `values` are physical; `jacobian` is of the residuals with respect to them, columns of fixed
    ones zero. `moves` is the derivative of the values by each coordinate that was fitted, one
    column for each group of tied values. `slope` is the cosine between the residuals and the range
    of the Jacobian, less its rounding error: 0 at an optimum, 1 where a value that mattered at the
    start has run to where it does not. Directions that change no residual from the start do not
    count, so `converged` says nothing about them: they show as zeros of `spectrum` and as infinite
    `stderr`. `reason` says why `converged` is false, else it is empty. `trace` lists (steps, cost)
    by stage.
    """

    values: np.ndarray
    residual: np.ndarray
    jacobian: np.ndarray
    moves: np.ndarray
    free: np.ndarray
    at_bound: np.ndarray
    slope: float
    steps: int
    converged: bool
    reason: str
    trace: tuple[tuple[int, float], ...]

    @property
    def cost(self) -> float:
        """Half the sum of squared residuals."""
        return 0.5 * float(self.residual @ self.residual)

    @property
    def degrees(self) -> int:
        """Residuals less free parameters; values tied together count as one."""
        return self.residual.size - self.moves.shape[1]

    @cached_property
    def spectrum(self) -> tuple[np.ndarray, np.ndarray]:
        """Singular values (largest first) and right vectors of the column-scaled free Jacobian."""
        return singular_directions(scale_columns(self.jacobian[:, self.free])[0])

    @cached_property
    def covariance(self) -> np.ndarray:
        """`s^2 (J'J)^-1`, for white residuals; infinite where undetermined."""
        gram = inverse_gram(self.jacobian @ self.moves)
        unknown = ~np.isfinite(np.diag(gram)) | (self.degrees <= 0)
        sigma2 = 2.0 * self.cost / max(self.degrees, 1)
        out = sigma2 * self.moves @ np.where(np.isfinite(gram), gram, 0.0) @ self.moves.T
        undetermined = (self.moves[:, unknown] != 0).any(axis=1)
        out[undetermined, undetermined] = np.inf
        return out

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors for white residuals."""
        return np.sqrt(np.diag(self.covariance))


@float64
def least_squares(
    residual: Residual,
    start: Any,
    args: Any = None,
    *,
    bounds: Bounds | None = None,
    free: np.ndarray | None = None,
    ties: np.ndarray | None = None,
    options: SolverOptions = DEFAULTS,
) -> LeastSquares:
    """Minimise the sum of squares of `residual(values, args)`.

    **Arguments:**

    - `residual`: a JAX function; pass data through `args`, so that the next fit reuses the compiled
      code. `start`: values to start from, shape `parameters`.
    - `bounds`: see `Bounds`; none by default. `free`: which values may move; all by default.
    - `ties`: for each value, the number of its group; values of one group move together in the
      unbounded coordinate. By default each is its own group.
    - `options`: tolerances and the limit of steps.
    """
    tolerance, slope, max_steps = options.tolerance, options.slope, options.max_steps
    first = np.asarray(start, dtype=np.float64)
    free = np.ones(first.size, dtype=bool) if free is None else np.asarray(free)
    bounds = Bounds.of(first) if bounds is None else bounds
    group = np.arange(first.size) if ties is None else np.asarray(ties)
    tie = (group[:, None] == np.arange(first.size)[None, :]) & free[:, None]
    x = jnp.asarray(bounds.coordinates(first))
    begin = _Point.at(residual, bounds, x, args)
    count = int(tie.any(axis=0).sum())
    if not begin.finite(tie):
        return _finish(bounds, begin, tie, slope, np.nan, "not finite at the start", [])
    initial = begin.slope(bounds, tie, slope)
    if begin.value.size < count:
        why = f"{begin.value.size} residuals cannot fix {count} parameters"
        return _finish(bounds, begin, tie, slope, initial, why, [])
    alive = (begin.jacobian @ tie != 0).any(axis=0)
    best, flattest, trace, steps = begin, initial, [(0, begin.cost)], 0
    for reach in (
        THRESHOLDS.first_step_large,
        THRESHOLDS.first_step_medium,
        THRESHOLDS.first_step_small,
    ):
        point, angle, quiet = begin, initial, 0
        while steps < max_steps and quiet < 2 and angle > slope:
            unit = np.sqrt(2.0 * point.cost)
            length = np.linalg.norm(point.jacobian @ tie, axis=0) / unit
            basis = tie * np.where(length > 0, reach / np.where(length > 0, length, 1.0), 0.0)
            scaled = jnp.asarray(unit)  # an array: a number would compile anew for each value
            x, taken, stretch, small = _stage(
                residual,
                bounds,
                point.x,
                jnp.asarray(basis),
                scaled,
                args,
                tolerance,
                options.promise,
            )
            new = _Point.at(residual, bounds, x, args)
            steps += int(taken)
            scale = reach * float(stretch)
            reach = float(
                np.clip(scale, THRESHOLDS.smallest_step_scale, THRESHOLDS.largest_step_scale)
            )
            gain = 1.0 - new.cost / point.cost
            if gain > 0 and new.finite(tie):
                point = new
                lost = alive & (new.jacobian @ tie == 0).all(axis=0)
                angle = 1.0 if lost.any() else new.slope(bounds, tie, slope)
            if gain > THRESHOLDS.at_rest:
                quiet = 0
            else:  # at rest twice, or once where the solver itself says that nothing is left
                quiet = 2 if small else quiet + 1
            trace.append((steps, point.cost))
        if quiet and angle > slope:
            point, angle = _polish(residual, bounds, point, args, tie, slope, angle)
        if point.cost < best.cost:
            best, flattest = point, angle
        if steps >= max_steps or flattest <= THRESHOLDS.failed_slope or best.exact:
            break
    why = f"{max_steps} steps were not enough" if steps >= max_steps else ""
    if flattest <= slope or best.exact:
        why = ""
    return _finish(bounds, best, tie, slope, flattest, why, trace)


def _polish(residual, bounds, point, args, tie, wanted, angle) -> tuple["_Point", float]:
    """The optimum to rounding, by whole Gauss-Newton steps.

    Where the cost no longer shows which of two points is lower, the slope still does.
    """
    for _ in range(THRESHOLDS.polish_steps):
        columns = point.jacobian @ tie
        length = np.linalg.norm(columns, axis=0)
        unit = np.where(length > 0, length, np.inf)
        step = np.linalg.lstsq(columns / unit, -point.value, rcond=_EPS)[0] / unit
        move = tie @ step
        if not (
            np.abs(move) <= THRESHOLDS.polish_distance * (1.0 + np.abs(np.asarray(point.x)))
        ).all():
            break  # on its way elsewhere, not at rest
        x = point.x + jnp.asarray(move)
        new = _Point.at(residual, bounds, x, args)
        if not new.finite(tie) or not new.cost <= point.cost * (1.0 + THRESHOLDS.polish_cost_rise):
            break
        flat = new.slope(bounds, tie, wanted)
        if not flat < angle:
            break
        point, angle = new, flat
        if angle <= wanted:
            break
    return point, angle


@dataclasses.dataclass(frozen=True, eq=False)
class _Point:
    """Unbounded coordinates, residuals and physical values there, and the Jacobians of both."""

    x: Array
    value: np.ndarray
    jacobian: np.ndarray
    physical: np.ndarray
    inner: np.ndarray  # Jacobian of the physical values

    @classmethod
    def at(cls, residual: Residual, bounds: Bounds, x: Array, args: Any) -> "_Point":
        """What is known at the coordinates `x`."""
        return cls(x, *(np.asarray(a) for a in _evaluate(residual, bounds, x, args)))

    @cached_property
    def cost(self) -> float:
        """Half the sum of squared residuals; not a number or infinite where it overflows."""
        with np.errstate(over="ignore", invalid="ignore"):
            return 0.5 * float(self.value @ self.value)

    @property
    def exact(self) -> bool:
        """Whether the residuals are no more than rounding of what the parameters make."""
        made = self.jacobian @ np.asarray(self.x)
        return bool(np.linalg.norm(self.value) <= THRESHOLDS.exact_fit * np.linalg.norm(made))

    def finite(self, tie: np.ndarray) -> bool:
        """Whether a solver can go on from here."""
        moved = self.jacobian[:, tie.any(axis=1)]
        return bool(np.isfinite(self.cost) and np.isfinite(moved).all())

    def slope(self, bounds: Bounds, tie: np.ndarray, wanted: float) -> float:
        """Cosine between the residuals and what the coordinates can change, less rounding.

        A coordinate on its way into a bound does not count once what is left to gain there, the
        gradient times the distance, is as small as `wanted`.
        """
        unit = np.sqrt(2.0 * self.cost)
        if unit == 0.0:
            return 0.0
        x = np.asarray(self.x)
        moved = np.where(tie.any(axis=1), self.jacobian, 0.0)
        # Distance and derivative of the bijection near a bound combine to the coordinate itself.
        left = (self.value @ moved) * x / unit**2
        near = bounds.at_bound(self.physical)
        pinned = near & (left <= 0) & (left >= -wanted)
        columns = moved @ (tie & ~pinned[:, None])
        length = np.linalg.norm(columns, axis=0)
        columns = columns[:, length > 0] / length[length > 0]
        # R of [J r] ends in the residuals' components along the range of J.
        factor = qr_factor(np.column_stack([columns, self.value / unit]))
        turn, s, _ = np.linalg.svd(factor[: columns.shape[1], :-1])
        cosine = np.abs(factor[: columns.shape[1], -1] @ turn)[: s.size]
        # Rounding error: of the parameters, and of the Jacobian in its weak directions.
        rounding = _EPS * np.linalg.norm(np.abs(moved) @ np.abs(x)) / unit
        weak = _EPS * np.sqrt(s.size) * s.max(initial=0.0) / np.where(s > 0, s, _EPS)
        return float(np.linalg.norm(np.maximum(cosine - rounding - weak, 0.0)))


def _finish(bounds, point, tie, wanted, slope, why, trace) -> LeastSquares:
    values, inner = point.physical, point.inner
    trace = trace or [(0, point.cost)]
    if not why and not (slope <= wanted or point.exact):
        why = f"the gradient is not zero at the end (cosine {slope:.1e})"
    free = tie.any(axis=1)
    coupling = np.asarray(bounds.coupling)
    own = np.diag(np.linalg.solve(coupling, inner))  # of each bounded value alone
    flat = np.where(own > 0, 1.0 / np.where(own > 0, own, 1.0), 0.0)
    physical = np.where(free, point.jacobian, 0.0) * flat @ np.linalg.inv(coupling)
    return LeastSquares(
        values,
        point.value,
        np.where(free, physical, 0.0),
        np.where(free[:, None], inner @ tie, 0.0)[:, tie.any(axis=0)],
        free,
        bounds.at_bound(values) & free,
        slope,
        trace[-1][0],
        not why,
        why,
        tuple(trace),
    )
