"""Response and derivatives at the samples, spread from the intervals between contacts."""

import dataclasses
from typing import TYPE_CHECKING, Optional

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Float, Int

from fitting.identification._parameter_vector import as_device
from fitting.solver._quick_compilation import quick_jit

from ._residual import IntervalResidual, find_lines
from ._sums import IntervalSums

if TYPE_CHECKING:
    from fitting.identification.problem._problem import Problem


@dataclasses.dataclass(frozen=True, eq=False)
class IntervalSamples:
    """The sum of plays at the samples of all runs, and its derivatives.

    On an interval it is `level + slope u`; the first row of both is the sum itself, the others are
    its derivatives by the values that a fit moves. `count`: nodes in each interval.
    """

    level: Float[np.ndarray, "rows runs intervals"]
    slope: Float[np.ndarray, "rows runs intervals"]
    count: Int[np.ndarray, "runs intervals"]
    u: Float[np.ndarray, "runs nodes"]
    place: Int[np.ndarray, "runs time"]
    rest: Float[np.ndarray, "runs time"]  # what of the memoryless part is held

    @classmethod
    def of(
        cls, problem: "Problem", own: np.ndarray, weight: np.ndarray, move: np.ndarray
    ) -> Optional["IntervalSamples"]:
        """Those at the vector `own`, by the values that `move`; `None` where there are none."""
        sums = IntervalSums.of(problem, own)
        if sums is None:
            return None
        residual = problem.residual(IntervalResidual)
        basis = as_device(np.eye(own.size)[move])
        *lines, edge = _linearise(residual, as_device(own), basis, sums.data(weight))
        level, slope = (np.asarray(x).reshape(len(x), edge.shape[0], -1) for x in lines)
        if np.isnan(level[0]).any():
            return None
        count = np.diff(np.asarray(edge), axis=2).reshape(level.shape[1:])
        place = problem.data.drives["place"]
        return cls(level, slope, count, sums.stretched.u, place, sums.rest)

    @property
    def response(self) -> Float[np.ndarray, "runs time"]:
        """The model's response without what is solved for."""
        return self._spread(slice(0, 1))[:, 0] + self.rest

    @property
    def derivatives(self) -> Float[np.ndarray, "runs moved time"]:
        """Of the response, by each value that moves."""
        return self._spread(slice(1, None))

    def _spread(self, rows: slice) -> Float[np.ndarray, "runs rows time"]:
        out = []
        for row, (u, place) in enumerate(zip(self.u, self.place, strict=True)):
            level, slope = (
                np.repeat(x[rows, row], self.count[row], axis=1) for x in (self.level, self.slope)
            )
            slope *= u
            slope += level
            whole = place.size == u.size and (place == np.arange(u.size)).all()
            out.append(slope if whole else slope[:, place])
        return np.stack(out)


@quick_jit
def _linearise(residual, values, basis, data):
    """Levels and slopes with their derivatives along `basis`, and where intervals begin."""

    def lines(values):
        found = find_lines(residual, values, data)
        weights = residual.weights(values)
        return (found.level @ weights, found.slope @ weights), found.edge

    value, push, edge = jax.linearize(lines, values, has_aux=True)
    moved = jax.vmap(push)(basis)
    both = (jnp.concatenate([x[None], dx]) for x, dx in zip(value, moved, strict=True))
    return *both, edge
