"""Levenberg-Marquardt steps as compiled programs, and residuals with their Jacobian."""

from collections.abc import Callable
from typing import Any, Protocol, runtime_checkable

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array

from ._bound_transform import Bounds
from ._normal_equations import NormalEquations
from ._promised_decrease import StopByPromise
from ._quick_compilation import quick_jit
from ._thresholds import THRESHOLDS

Residual = Callable[[Array, Any], Array]  # (values, args) -> residuals


@runtime_checkable
class Projected(Protocol):
    """A residual that solves for some of its values itself, which must have no bounds.

    `solved` returns the residuals and the values for which they hold; derivatives by the values
    solved for are those of a residual that takes them as they are.
    """

    def __call__(self, values: Array, args: Any, /) -> Array: ...

    def solved(self, values: Array, args: Any, /) -> tuple[Array, Array]: ...


def _residual(residual: Residual, bounds: Bounds, x: Array, args: Any) -> Array:
    return residual(bounds.values(x), args)


def linearise_at(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, Array]:
    """Residuals and their Jacobian with respect to the unbounded coordinates."""
    value, push = jax.linearize(lambda x: _residual(residual, bounds, x, args), x)
    return value, jax.vmap(push, out_axes=1)(jnp.eye(x.size))


linearise = quick_jit(linearise_at)


def evaluate_at(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, ...]:
    """Coordinates, residuals there and their Jacobian, then the values there and theirs.

    The coordinates are `x`, but for values that `residual` solves for.
    """
    values, inner = bounds.linearise(x)
    if not isinstance(residual, Projected):
        return x, *linearise_at(residual, bounds, x, args), values, inner

    def both(x: Array) -> tuple[Array, Array]:
        return residual.solved(bounds.values(x), args)

    value, push, solved = jax.linearize(both, x, has_aux=True)
    jacobian = jax.vmap(push, out_axes=1)(jnp.eye(x.size))
    change = jnp.where(solved == values, 0.0, (solved - values) / jnp.diag(inner))
    return x + change, value, jacobian, solved, inner


evaluate = quick_jit(evaluate_at)


def _stage_residual(z: Array, args: Any) -> Array:
    residual, bounds, center, basis, unit, inner = args
    return _residual(residual, bounds, center + basis @ z, inner) / unit


def take_steps(
    residual: Residual,
    bounds: Bounds,
    center: Array,
    basis: Array,
    unit: Array,
    args: Any,
    tolerance: float,
    promise: Array,
    most: int,
    guarded: bool = True,
) -> tuple[Array, Array, Array, Array]:
    """Up to `most` steps from `center` along the columns of `basis`, residuals in units of `unit`.

    Returns the coordinates, how many steps were taken, by how much the trust region has grown, and
    whether the next step promises less than `promise` of the cost. `guarded`: see
    `NormalEquations`.
    """
    solver = optx.LevenbergMarquardt(
        rtol=tolerance, atol=tolerance, linear_solver=NormalEquations(guarded)
    )
    search = optx.ClassicalTrustRegion(high_cutoff=THRESHOLDS.region_growth)
    solver = eqx.tree_at(lambda s: s.search, solver, search)
    solver = StopByPromise(solver, promise)
    solution = optx.least_squares(
        _stage_residual,
        solver,
        jnp.zeros(basis.shape[1]),
        (residual, bounds, center, basis, unit, args),
        max_steps=most,
        throw=False,
    )
    # The damping, 1 / step size, is relative to squared column lengths.
    stretch = jnp.sqrt(solution.state.inner.search_state.step_size)
    small = solution.state.small
    return center + basis @ solution.value, solution.stats["num_steps"], stretch, small


@quick_jit
def take_stage(residual, bounds, center, basis, unit, args, tolerance, promise):
    """`take_steps`, as many as coordinates are scaled for."""
    return take_steps(
        residual, bounds, center, basis, unit, args, tolerance, promise, THRESHOLDS.stage_steps
    )
