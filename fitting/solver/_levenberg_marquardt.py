"""Levenberg-Marquardt steps as compiled programs, and residuals with their Jacobian."""

from collections.abc import Callable
from typing import Any

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


def _residual(residual: Residual, bounds: Bounds, x: Array, args: Any) -> Array:
    return residual(bounds.values(x), args)


def linearise_at(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, Array]:
    """Residuals and their Jacobian with respect to the unbounded coordinates."""
    value, push = jax.linearize(lambda x: _residual(residual, bounds, x, args), x)
    return value, jax.vmap(push, out_axes=1)(jnp.eye(x.size))


linearise = quick_jit(linearise_at)


def evaluate_at(residual: Residual, bounds: Bounds, x: Array, args: Any) -> tuple[Array, ...]:
    """Residuals at `x` and their Jacobian, then the values there and theirs."""
    return *linearise_at(residual, bounds, x, args), *bounds.linearise(x)


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
