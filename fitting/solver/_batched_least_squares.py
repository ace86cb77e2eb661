"""Least squares for many problems of one shape at once, those that have ended taken out.

The problems are lanes of one compiled program. After every few steps the lanes that have come to
rest leave, so that they hold up no others. A lane that does not reach an optimum so is left to
`least_squares`, which tries more.
"""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax.internal import float64

from ._bound_transform import Bounds
from ._least_squares import SolverOptions, tie_matrix
from ._levenberg_marquardt import Residual, evaluate_at, linearise_at, take_steps
from ._optimum import LeastSquares, Point, finish
from ._promised_decrease import cosine
from ._quick_compilation import quick_jit
from ._thresholds import THRESHOLDS


@dataclasses.dataclass
class _Lane:
    """Where a lane stands: unbounded coordinates, length of its next step, cost, slope, steps."""

    x: np.ndarray
    reach: float = THRESHOLDS.first_step_large
    cost: float = np.nan
    slope: float = np.inf
    steps: int = 0
    quiet: int = 0
    small: bool = False
    trace: tuple[tuple[int, float], ...] = ()

    def goes_on(self, options: SolverOptions) -> bool:
        """Whether more steps may find the optimum."""
        return self.slope > options.slope and self.quiet < 2 and self.steps < options.max_steps

    def has_ended(self, options: SolverOptions) -> bool:
        """Whether this is an optimum, or as near to one as the solver is asked to come."""
        near = self.small and self.slope**2 <= options.whole_promise
        return self.slope <= options.slope or near

    def move(self, new: dict[str, Any]) -> None:
        """Take over what some steps led to."""
        gain = 1.0 - float(new["cost"]) / float(new["before"])
        if not np.isfinite(self.cost):
            self.trace = ((0, float(new["before"])),)
        self.x, self.reach, self.cost = new["x"], float(new["reach"]), float(new["cost"])
        self.slope = float(new["slope"])  # NaN, where no number was found, ends the lane, too
        self.steps += int(new["steps"])
        self.small = bool(new["small"])
        at_rest = not gain > THRESHOLDS.at_rest
        self.quiet = (2 if self.small else self.quiet + 1) if at_rest else 0
        self.trace += ((self.steps, self.cost),)


@float64
def least_squares_many(
    residual: Residual,
    starts: Float[np.ndarray, "lanes parameters"],
    args: Any,
    *,
    bounds: Bounds,
    free: np.ndarray,
    ties: np.ndarray | None = None,
    options: SolverOptions,
) -> list[LeastSquares | None]:
    """Minimise the sums of squares of many problems, each from its own start.

    **Arguments:**

    - `residual`, `args`, `bounds`: as for `least_squares`, each array with a first axis of lanes.
    - `free`, `ties`, `options`: as for `least_squares`, the same in all lanes.

    **Returns** the end of each lane; `None` where that is not an optimum.
    """
    whole = tie_matrix(starts.shape[1], free, ties)
    tie = whole[:, whole.any(axis=0)].astype(float)
    each = [_lane(bounds, i).holding(free) for i in range(len(starts))]
    bounds = jax.tree_util.tree_map(lambda *leaves: np.stack(leaves), *each)
    lanes = [_Lane(own.coordinates(start)) for own, start in zip(each, starts, strict=True)]
    problem = jax.device_put(eqx.filter((residual, bounds, args), eqx.is_array))
    problem = eqx.combine(problem, (residual, bounds, args))
    going = list(range(len(lanes)))
    while going:
        index = _padded(going)
        x = np.stack([lanes[i].x for i in index])
        reach = np.array([lanes[i].reach for i in index])
        ended = _advance(
            problem, index, x, reach, tie, options.tolerance, jnp.asarray(options.promise)
        )
        found = {name: np.asarray(value) for name, value in ended.items()}
        for place, i in enumerate(going):
            lanes[i].move({name: value[place] for name, value in found.items()})
        going = [i for i in going if lanes[i].goes_on(options)]
    good = [i for i, lane in enumerate(lanes) if lane.has_ended(options)]
    ends: list[LeastSquares | None] = [None] * len(lanes)
    if good:
        index = _padded(good)
        x = np.stack([lanes[i].x for i in index])
        found = [np.asarray(value) for value in _evaluate(problem, index, x)]
        for place, i in enumerate(good):
            x, *known = (value[place] for value in found)
            point = Point(jnp.asarray(x), *known)
            lane = lanes[i]
            ends[i] = finish(each[i], point, whole, options.slope, lane.slope, "", [*lane.trace])
    return ends


def _lane(tree: Any, i: int) -> Any:
    return jax.tree_util.tree_map(lambda leaf: np.asarray(leaf[i]), tree)


def _padded(lanes: list[int]) -> np.ndarray:
    """The lanes and the last of them again, so that few numbers of lanes are compiled for."""
    size = 1
    while size < len(lanes):
        size *= THRESHOLDS.lane_growth
    return np.array(lanes + lanes[-1:] * (size - len(lanes)), dtype=np.int32)


@quick_jit
def _advance(problem, index, x, reach, tie, tolerance, promise) -> dict[str, Array]:
    """Some steps of the lanes `index`."""

    def one(chosen, x, reach):
        residual, bounds, args = chosen
        value, jacobian = linearise_at(residual, bounds, x, args)
        before = jnp.sum(value**2) / 2.0
        unit = jnp.sqrt(2.0 * before)
        length = jnp.linalg.norm(jacobian @ tie, axis=0) / unit
        shorter = jnp.where(length > 0, reach / jnp.where(length > 0, length, 1.0), 0.0)
        basis = tie * shorter[None, :]
        end, steps, stretch, small = take_steps(
            residual, bounds, x, basis, unit, args, tolerance, promise, THRESHOLDS.lane_steps, False
        )
        moved, slopes = linearise_at(residual, bounds, end, args)
        cost = jnp.sum(moved**2) / 2.0
        better = cost < before
        value, jacobian = (jnp.where(better, a, b) for a, b in ((moved, value), (slopes, jacobian)))
        columns = jacobian @ tie
        dead = jnp.all(columns == 0, axis=0)  # what mattered at the start may have run away
        return {
            "x": jnp.where(better, end, x),
            "before": before,
            "cost": jnp.where(better, cost, before),
            "slope": jnp.where(jnp.any(dead), jnp.inf, cosine(value, columns)),
            "reach": jnp.clip(
                reach * stretch, THRESHOLDS.smallest_step_scale, THRESHOLDS.largest_step_scale
            ),
            "steps": steps,
            "small": small,
        }

    return _mapped(one, problem, index, x, reach)


@quick_jit
def _evaluate(problem, index, x) -> tuple[Array, ...]:
    """Residuals of the lanes `index` and their Jacobian, then the values there and theirs."""

    def one(chosen, x):
        residual, bounds, args = chosen
        return evaluate_at(residual, bounds, x, args)

    return _mapped(one, problem, index, x)


def _mapped(function, problem, index, *others):
    arrays, rest = eqx.partition(problem, eqx.is_array)
    chosen = jax.tree_util.tree_map(lambda leaf: leaf[index], arrays)
    return jax.vmap(lambda own, *more: function(eqx.combine(own, rest), *more))(chosen, *others)
