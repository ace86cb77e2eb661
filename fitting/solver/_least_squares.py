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
from typing import Any

import jax.numpy as jnp
import numpy as np

from rapi_jax.internal import float64

from ._bound_transform import Bounds
from ._levenberg_marquardt import Residual, take_stage
from ._optimum import LeastSquares, Point, finish
from ._thresholds import THRESHOLDS

_EPS = float(np.finfo(float).eps)


@dataclasses.dataclass(frozen=True)
class SolverOptions:
    """How far a fit is driven.

    `tolerance`: the solver's relative and absolute tolerance in scaled coordinates. `slope`: the
    cosine between residuals and Jacobian below which the end counts as an optimum. `max_steps`: the
    limit of steps over all attempts, checked after each stage; a curved valley may take thousands.
    `promise`, `whole_promise`: the shares of the cost that the next step and, undamped, a whole
    step must promise, one of them at least, for the solver to go on.

    >>> from fitting import SolverOptions
    >>> SolverOptions(max_steps=200).tolerance
    1e-08
    """

    tolerance: float = 1e-8
    slope: float = 1e-7
    max_steps: int = 20_000
    promise: float = 0.0
    whole_promise: float = 0.0


DEFAULTS = SolverOptions()


def tie_matrix(size: int, free: np.ndarray, ties: np.ndarray | None) -> np.ndarray:
    """Whether a value (row) moves with the coordinate of a group (column)."""
    group = np.arange(size) if ties is None else np.asarray(ties)
    return (group[:, None] == np.arange(size)[None, :]) & np.asarray(free)[:, None]


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
    - `bounds`: see `Bounds`; none by default. `free`: which values may move; all by default. The
      others stay as they are, also on or beyond a bound.
    - `ties`: for each value, the number of its group; values of one group move together in the
      unbounded coordinate. By default each is its own group.
    - `options`: tolerances and the limit of steps.

    >>> import jax.numpy as jnp
    >>> from fitting import least_squares
    >>> time = jnp.array([0.0, 1.0, 2.0, 3.0])
    >>> residual = lambda x, time: x[0] * jnp.exp(-x[1] * time) - 4.0 * jnp.exp(-0.5 * time)
    >>> least_squares(residual, jnp.array([1.0, 1.0]), time).values.round(6).tolist()
    [4.0, 0.5]
    """
    tolerance, slope, max_steps = options.tolerance, options.slope, options.max_steps
    first = np.asarray(start, dtype=np.float64)
    free = np.ones(first.size, dtype=bool) if free is None else np.asarray(free)
    bounds = (Bounds.of(first) if bounds is None else bounds).holding(free)
    tie = tie_matrix(first.size, free, ties)
    x = jnp.asarray(bounds.coordinates(first))
    begin = Point.at(residual, bounds, x, args)
    moving = tie.any(axis=0)
    count = int(moving.sum())
    if not begin.finite(tie):
        return finish(bounds, begin, tie, slope, np.nan, "not finite at the start", [])
    initial = begin.slope(bounds, tie, slope)
    if begin.value.size < count:
        why = f"{begin.value.size} residuals cannot fix {count} parameters"
        return finish(bounds, begin, tie, slope, initial, why, [])
    alive = (begin.jacobian @ tie != 0).any(axis=0)
    best, flattest, trace, steps = begin, initial, [(0, begin.cost)], 0
    for reach in (
        THRESHOLDS.first_step_large,
        THRESHOLDS.first_step_medium,
        THRESHOLDS.first_step_small,
    ):
        point, angle, quiet, promise, little_left = begin, initial, 0, options.promise, False
        while steps < max_steps and quiet < 2 and angle > slope and not little_left:
            unit = np.sqrt(2.0 * point.cost)
            length = np.linalg.norm(point.jacobian @ tie, axis=0) / unit
            basis = tie * np.where(length > 0, reach / np.where(length > 0, length, 1.0), 0.0)
            scaled = jnp.asarray(unit)  # an array: a number would compile anew for each value
            x, taken, stretch, small = take_stage(
                residual,
                bounds,
                point.x,
                jnp.asarray(basis),
                scaled,
                args,
                tolerance,
                jnp.asarray(promise),
            )
            new = Point.at(residual, bounds, x, args)
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
            quiet = 0 if gain > THRESHOLDS.at_rest else quiet + 1
            if small:
                little_left = angle**2 <= options.whole_promise
                promise = 0.0  # else short steps, of which many lead far: a curved valley
            trace.append((steps, point.cost))
        if quiet and angle > slope and not little_left:
            point, angle = _polish(residual, bounds, point, args, tie, slope, angle)
        if point.cost < best.cost:
            best, flattest = point, angle
        if steps >= max_steps or flattest <= THRESHOLDS.failed_slope or best.exact:
            break
    why = f"{max_steps} steps were not enough" if steps >= max_steps else ""
    if flattest <= slope or best.exact:
        why = ""
    return finish(bounds, best, tie, slope, flattest, why, trace)


def _polish(residual, bounds, point, args, tie, wanted, angle) -> tuple[Point, float]:
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
        new = Point.at(residual, bounds, x, args)
        if not new.finite(tie) or not new.cost <= point.cost * (1.0 + THRESHOLDS.polish_cost_rise):
            break
        flat = new.slope(bounds, tie, wanted)
        if not flat < angle:
            break
        point, angle = new, flat
        if angle <= wanted:
            break
    return point, angle
