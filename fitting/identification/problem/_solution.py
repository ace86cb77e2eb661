"""A problem evaluated at some values, as at the end of a fit, and what follows from it."""

import dataclasses
from collections.abc import Callable
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from fitting.identification.intervals._samples import IntervalSamples
from fitting.solver._optimum import LeastSquares
from rapi_jax.internal import float64

if TYPE_CHECKING:
    from ._problem import Problem


@dataclasses.dataclass(frozen=True, eq=False)
class Evaluation:
    """A problem at some values, and what follows from it once it is asked for.

    `own`: the vector that the solver sees, without offsets and drift, its linear part zero; `move`:
    which of it may move. `weight`: square roots of the samples' weights. What is linear is solved
    for.
    """

    problem: "Problem"
    own: np.ndarray
    move: np.ndarray
    weight: np.ndarray

    @property
    def start(self) -> np.ndarray:
        """`values` without what is solved for: enough to begin another fit."""
        return self.problem.whole_vector(self.own)

    @property
    def values(self) -> np.ndarray:
        """The whole vector (model, offsets, drift, initial fractions), as `Problem.names`."""
        return self._solved[0]

    @property
    def error(self) -> np.ndarray:
        """Model less data, "runs time"; also where it was not fitted."""
        return self._solved[1]

    @property
    def squares(self) -> float:
        """The weighted sum of squared errors; infinite where it overflows."""
        with np.errstate(over="ignore"):
            return float(np.sum((self.weight * self.error) ** 2))

    @cached_property
    @float64
    def jacobian(self) -> np.ndarray:
        """Of the weighted errors with respect to `values`; "samples values"."""
        problem, weight = self.problem, self.weight
        n, extra = problem.vector.size, problem.nuisances
        full = np.zeros((weight.size, self.own.size + extra))
        places = np.r_[0:n, n + extra : full.shape[1]][self.move]
        if self._samples is not None:
            columns = weight[:, None, :] * self._samples.derivatives
            full[:, places] = columns.transpose(0, 2, 1).reshape(weight.size, -1)
        else:
            full[:, places] = problem.differentiate(self.own, weight)[:, self.move]
        linear = problem.linear_part(weight)
        full[:, linear.places] = linear.columns
        return full

    @cached_property
    @float64
    def _solved(self) -> tuple[np.ndarray, np.ndarray]:
        known = self._samples
        error = None if known is None else known.response - self.problem.data.y
        return self.problem.solve_linear(self.own, self.weight, error)

    @cached_property
    @float64
    def _samples(self) -> IntervalSamples | None:
        return IntervalSamples.of(self.problem, self.own, self.weight, self.move)


@dataclasses.dataclass(frozen=True, eq=False)
class Solution(Evaluation):
    """One fit: the problem at its end, and the solver's report."""

    solver: LeastSquares

    @property
    def cost(self) -> float:
        """Half the weighted sum of squares."""
        return self.solver.cost


# A fit of a problem from a vector under weights, as far as a check of the data needs it.
Fit = Callable[["Problem", np.ndarray, np.ndarray], Evaluation]
