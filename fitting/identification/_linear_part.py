"""The linear part of a fitting problem: its columns, projected out of residuals and solved for."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from fitting.solver._identifiability import is_determined, scale_columns, singular_directions

from ._thresholds import THRESHOLDS


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
