"""The linear part of a fitting problem: its columns, projected out of residuals and solved for."""

import dataclasses
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from fitting.identification._thresholds import THRESHOLDS
from fitting.solver._identifiability import is_determined, scale_columns, singular_directions

if TYPE_CHECKING:
    from ._problem import Problem


@dataclasses.dataclass(frozen=True, eq=False)
class LinearPart:
    """Weighted columns of parameters that are linear, decomposed.

    - `columns`: weighted. `places`: of their parameters in the problem's vector.
    - `whitening`: `columns @ whitening` is `basis`. `solution`: the same of what is solved for.
    """

    columns: Float[np.ndarray, "samples linear"]
    places: Int[np.ndarray, " linear"]
    whitening: Float[np.ndarray, "linear linear"]
    solution: Float[np.ndarray, "linear linear"]

    @classmethod
    def of(cls, columns: np.ndarray, places: np.ndarray) -> "LinearPart":
        """The columns and what follows from them."""
        scaled, length = scale_columns(columns)
        size, right = singular_directions(scaled)
        unit = np.where(length > 0, length, 1.0)

        def spread(tolerance: float) -> np.ndarray:
            kept = is_determined(size, tolerance)
            return right.T * (kept / np.where(kept, size, 1.0)) / unit[:, None]

        whitening, solution = map(spread, (THRESHOLDS.linear_rank, THRESHOLDS.linear_solution_rank))
        return cls(columns, places, whitening, solution)

    @cached_property
    def basis(self) -> Float[np.ndarray, "samples linear"]:
        """Orthonormal columns of the same range, zeros in place of those that depend on others."""
        return self.columns @ self.whitening

    def solve(self, flat: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " linear"]:
        """The parameters that minimise weighted residuals, `flat` where all of them are 0."""
        first = -self.solution @ (self.solution.T @ (self.columns.T @ flat))
        left = flat + self.columns @ first  # once more: half of the digits are lost in squares
        return first - self.solution @ (self.solution.T @ (self.columns.T @ left))


def linear_columns(problem: "Problem") -> tuple[np.ndarray, np.ndarray]:
    """Columns of the linear part, "runs time linear", and their places in the vector."""
    names = problem.vector.names
    shape = problem.data.u.shape
    basis = problem.ecdl.operator.linear_basis(problem.data.u)
    columns, places = [], []
    for at in np.flatnonzero(problem.linear):
        if names[at] != problem.constant or not problem.own_origin:
            columns.append(basis[names[at]])
            places.append(at)
    for run in range(problem.offsets):
        columns.append(np.broadcast_to((np.arange(shape[0]) == run)[:, None], shape))
        places.append(problem.vector.size + run)
    if problem.drift is not None:
        columns.append(problem.drift)
        places.append(problem.vector.size + problem.offsets)
    if not columns:
        return np.zeros((*shape, 0)), np.zeros(0, dtype=int)
    return np.stack(columns, axis=2), np.array(places)
