"""Nonlinear least squares on `optimistix.LevenbergMarquardt`: scaled, bounded, judged afterwards.

The solver runs in stages. Each stage measures coordinates so that every column of the Jacobian has
the same length, and residuals so that they have length one; both are taken afresh where the last
stage ended, and the trust region is carried over. So the tolerances mean the same for every model
and unit, and a stage that the solver calls finished too early is simply continued. Whether the end
is an optimum is decided from the gradient there, never from the solver's own flag. A descent that
comes to rest far from any optimum was thrown there by a first step: it is made again from the start
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

from rapi_jax._precision import float64

from ._bound_transform import Bounds
from ._normal_equations import NormalEquations

Residual = Callable[[Array, Any], Array]  # (values, args) -> residuals
_STAGE_STEPS = 40
_REACH = (10.0, 1.0, 0.1)  # column lengths at each attempt's start: how bold the first step is
_REACH_LIMITS = (1e-3, 1e4)
_AT_REST = 1e-10  # relative gain of a stage below which nothing happens any more
_LOST = 0.1  # at rest with a steeper slope than this, a descent has failed
_EXACT = 1e-13  # residuals this small, relative to what the parameters make, are rounding
_WHOLE = 3  # Gauss-Newton steps at rest
_SAME = 1e-9  # relative rise of the cost that rounding of small residuals brings about
_NEAR = 1e-3  # of a coordinate: the farthest that such a step may lead
_EPS = float(np.finfo(float).eps)


def _residual(residual: Residual, bounds: Bounds, x: Array, args: Any) -> Array:
    return residual(bounds.values(x), args)


@eqx.filter_jit
def linearise(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, Array]:
    """Residuals and their Jacobian with respect to the unbounded coordinates."""
    value, push = jax.linearize(lambda x: _residual(residual, bounds, x, args), x)
    return value, jax.vmap(push, out_axes=1)(jnp.eye(x.size))


@eqx.filter_jit
def _physical(bounds: Bounds, x: Array) -> tuple[Array, Array]:
    """Values at `x`, and their Jacobian."""
    return bounds.values(x), jax.jacfwd(bounds.values)(x)


def _stage_residual(z: Array, args: Any) -> Array:
    residual, bounds, center, basis, unit, inner = args
    return _residual(residual, bounds, center + basis @ z, inner) / unit


@eqx.filter_jit
def _stage(residual, bounds, center, basis, unit, args, tolerance):
    solver = optx.LevenbergMarquardt(
        rtol=tolerance, atol=tolerance, linear_solver=NormalEquations()
    )
    # The default grows the region only after an almost perfect prediction: it crawls in valleys.
    solver = eqx.tree_at(lambda s: s.search, solver, optx.ClassicalTrustRegion(high_cutoff=0.75))
    solution = optx.least_squares(
        _stage_residual,
        solver,
        jnp.zeros_like(center),
        (residual, bounds, center, basis, unit, args),
        max_steps=_STAGE_STEPS,
        throw=False,
    )
    # The damping, 1 / step size, is relative to squared column lengths.
    stretch = jnp.sqrt(solution.state.search_state.step_size)
    return center + basis @ solution.value, solution.stats["num_steps"], stretch


@dataclasses.dataclass(frozen=True, eq=False)
class LeastSquares:
    """Where a fit ended, and what the ground looks like there.

    `values` are physical; `jacobian` is of the residuals with respect to them, columns of fixed
    ones zero. `moves` holds how the values move with each coordinate that was fitted, one column
    for each group of tied values. `slope` is the cosine between the residuals and the range of the
    Jacobian, less what rounding can feign: 0 at an optimum, 1 where a value that mattered at the
    start has run to where it does not. Directions that change no residual from the start do not
    count, so `converged` says nothing about them: they show as zeros of `spectrum` and as infinite
    `stderr`.
    `reason` says why `converged` is false, else it is empty. `trace` lists (steps, cost) by stage.
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
        columns = self.jacobian[:, self.free]
        length = np.linalg.norm(columns, axis=0)
        return _singular(columns / np.where(length > 0, length, 1.0))

    @cached_property
    def covariance(self) -> np.ndarray:
        """`s^2 (J'J)^-1`, for white residuals; infinite where undetermined."""
        gram = inverse_gram(self.jacobian @ self.moves)
        loose = ~np.isfinite(np.diag(gram)) | (self.degrees <= 0)
        sigma2 = 2.0 * self.cost / max(self.degrees, 1)
        out = sigma2 * self.moves @ np.where(np.isfinite(gram), gram, 0.0) @ self.moves.T
        undetermined = (self.moves[:, loose] != 0).any(axis=1)
        out[undetermined, undetermined] = np.inf
        return out

    @property
    def stderr(self) -> np.ndarray:
        """Standard errors for white residuals."""
        return np.sqrt(np.diag(self.covariance))


def _triangle(matrix: np.ndarray) -> np.ndarray:
    return np.asarray(np.linalg.qr(matrix, mode="r"))


def _singular(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Singular values and right vectors, as many as columns, also where there are fewer rows."""
    _, s, right = np.linalg.svd(_triangle(matrix))
    return np.pad(s, (0, matrix.shape[1] - s.size)), right


def pseudo_gram(jacobian: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`(J'J)^-1` on what `J` determines, and which columns it does not determine."""
    length = np.linalg.norm(jacobian, axis=0)
    s, right = _singular(jacobian / np.where(length > 0, length, 1.0))
    dead = s <= _EPS * max(jacobian.shape) * s.max(initial=0.0)
    spread = right.T * np.where(dead, 0.0, 1.0 / np.where(dead, 1.0, s))
    unit = np.where(length > 0, length, np.inf)
    loose = (np.abs(right[dead]) > 1e-6).any(axis=0) | (length == 0)
    return (spread @ spread.T) / np.outer(unit, unit), loose


def inverse_gram(jacobian: np.ndarray) -> np.ndarray:
    """`(J'J)^-1`; infinite variance where a column is dead or redundant."""
    out, loose = pseudo_gram(jacobian)
    out[loose, loose] = np.inf
    return out


@float64
def least_squares(
    residual: Residual,
    start: Any,
    args: Any = None,
    *,
    bounds: Bounds | None = None,
    free: np.ndarray | None = None,
    ties: np.ndarray | None = None,
    tolerance: float = 1e-8,
    slope: float = 1e-7,
    max_steps: int = 20_000,
) -> LeastSquares:
    """Minimise the sum of squares of `residual(values, args)`.

    **Arguments:**

    - `residual`: a JAX function; pass data through `args`, so that the next fit reuses the compiled
      code. `start`: values to start from, shape `parameters`.
    - `bounds`: see `Bounds`; none by default. `free`: which values may move; all by default.
    - `ties`: for each value, the number of its group; values of one group move together in the
      unbounded coordinate. By default each is its own group.
    - `tolerance`: the solver's relative and absolute tolerance in scaled coordinates. `slope`: the
      cosine between residuals and Jacobian below which the end counts as an optimum. `max_steps`:
      the limit of steps over all attempts, looked at after each stage; a curved valley may take
      thousands.
    """
    first = np.asarray(start, dtype=np.float64)
    free = np.ones(first.size, dtype=bool) if free is None else np.asarray(free)
    bounds = Bounds.of(first) if bounds is None else bounds
    group = np.arange(first.size) if ties is None else np.asarray(ties)
    tie = (group[:, None] == np.arange(first.size)[None, :]) & free[:, None]
    x = jnp.asarray(bounds.coordinates(first))
    begin = _Point(x, *(np.asarray(a) for a in linearise(residual, bounds, x, args)))
    count = int(tie.any(axis=0).sum())
    if not begin.finite(tie):
        return _finish(bounds, begin, tie, slope, np.nan, "not finite at the start", [])
    initial = begin.slope(bounds, tie, slope)
    if begin.value.size < count:
        why = f"{begin.value.size} residuals cannot fix {count} parameters"
        return _finish(bounds, begin, tie, slope, initial, why, [])
    alive = (begin.jacobian @ tie != 0).any(axis=0)
    best, flattest, trace, steps = begin, initial, [(0, begin.cost)], 0
    for reach in _REACH:
        point, angle, quiet = begin, initial, 0
        while steps < max_steps and quiet < 2 and angle > slope:
            unit = np.sqrt(2.0 * point.cost)
            length = np.linalg.norm(point.jacobian @ tie, axis=0) / unit
            basis = tie * np.where(length > 0, reach / np.where(length > 0, length, 1.0), 0.0)
            scaled = jnp.asarray(unit)  # an array: a number would compile anew for each value
            x, taken, stretch = _stage(
                residual, bounds, point.x, jnp.asarray(basis), scaled, args, tolerance
            )
            new = _Point(x, *(np.asarray(a) for a in linearise(residual, bounds, x, args)))
            steps += int(taken)
            reach = float(np.clip(reach * float(stretch), *_REACH_LIMITS))
            gain = 1.0 - new.cost / point.cost
            if gain > 0 and new.finite(tie):
                point = new
                lost = alive & (new.jacobian @ tie == 0).all(axis=0)
                angle = 1.0 if lost.any() else new.slope(bounds, tie, slope)
            quiet = 0 if gain > _AT_REST else quiet + 1
            trace.append((steps, point.cost))
        if quiet and angle > slope:
            point, angle = _flatter(residual, bounds, point, args, tie, slope, angle)
        if point.cost < best.cost:
            best, flattest = point, angle
        if steps >= max_steps or flattest <= _LOST or best.exact:
            break
    why = f"{max_steps} steps were not enough" if steps >= max_steps else ""
    if flattest <= slope or best.exact:
        why = ""
    return _finish(bounds, best, tie, slope, flattest, why, trace)


def _flatter(residual, bounds, point, args, tie, wanted, angle) -> tuple["_Point", float]:
    """The optimum to rounding, by whole Gauss-Newton steps.

    Where the cost no longer shows which of two points is lower, the slope still does.
    """
    for _ in range(_WHOLE):
        columns = point.jacobian @ tie
        length = np.linalg.norm(columns, axis=0)
        unit = np.where(length > 0, length, np.inf)
        step = np.linalg.lstsq(columns / unit, -point.value, rcond=_EPS)[0] / unit
        move = tie @ step
        if not (np.abs(move) <= _NEAR * (1.0 + np.abs(np.asarray(point.x)))).all():
            break  # on its way elsewhere, not at rest
        x = point.x + jnp.asarray(move)
        new = _Point(x, *(np.asarray(a) for a in linearise(residual, bounds, x, args)))
        if not new.finite(tie) or not new.cost <= point.cost * (1.0 + _SAME):
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
    """Unbounded coordinates, the residuals there, and their Jacobian."""

    x: Array
    value: np.ndarray
    jacobian: np.ndarray

    @cached_property
    def cost(self) -> float:
        """Half the sum of squared residuals; not a number or infinite where it overflows."""
        with np.errstate(over="ignore", invalid="ignore"):
            return 0.5 * float(self.value @ self.value)

    @property
    def exact(self) -> bool:
        """Whether the residuals are no more than rounding of what the parameters make."""
        made = self.jacobian @ np.asarray(self.x)
        return bool(np.linalg.norm(self.value) <= _EXACT * np.linalg.norm(made))

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
        near = bounds.at_bound(np.asarray(_physical(bounds, self.x)[0]))
        pinned = near & (left <= 0) & (left >= -wanted)
        columns = moved @ (tie & ~pinned[:, None])
        length = np.linalg.norm(columns, axis=0)
        columns = columns[:, length > 0] / length[length > 0]
        # R of [J r] ends in the residuals' components along the range of J.
        factor = _triangle(np.column_stack([columns, self.value / unit]))
        turn, s, _ = np.linalg.svd(factor[: columns.shape[1], :-1])
        cosine = np.abs(factor[: columns.shape[1], -1] @ turn)[: s.size]
        # What rounding can feign: of the parameters, and of the Jacobian in its weak directions.
        feigned = _EPS * np.linalg.norm(np.abs(moved) @ np.abs(x)) / unit
        weak = _EPS * np.sqrt(s.size) * s.max(initial=0.0) / np.where(s > 0, s, _EPS)
        return float(np.linalg.norm(np.maximum(cosine - feigned - weak, 0.0)))


def _finish(bounds, point, tie, wanted, slope, why, trace) -> LeastSquares:
    values, inner = (np.asarray(a) for a in _physical(bounds, point.x))
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
