"""The linear part of a fitting problem: its columns, projected out of residuals and solved for."""

import dataclasses

import numpy as np
from jaxtyping import Float, Int

from fitting.solver._identifiability import is_determined, scale_columns

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class LinearPart:
    """Weighted columns of parameters that are linear, decomposed.

    - `columns`: weighted. `places`: of their parameters in the problem's vector.
    - `basis`: orthonormal columns of the same range, zeros in place of those that depend on others.
    - `whitening`: `columns @ whitening` is `basis`.
    """

    columns: Float[np.ndarray, "samples linear"]
    places: Int[np.ndarray, " linear"]
    basis: Float[np.ndarray, "samples linear"]
    whitening: Float[np.ndarray, "linear linear"]
    pseudo_inverse: Float[np.ndarray, "linear samples"]

    @classmethod
    def of(cls, columns: np.ndarray, places: np.ndarray) -> "LinearPart":
        """The columns and what follows from them."""
        scaled, length = scale_columns(columns)
        left, size, right = np.linalg.svd(scaled, full_matrices=False)
        unit = np.where(length > 0, length, 1.0)
        kept = is_determined(size, THRESHOLDS.linear_rank)
        whitening = right.T * (kept / np.where(kept, size, 1.0)) / unit[:, None]
        known = is_determined(size, THRESHOLDS.linear_solution_rank)
        inverse = (right[known].T / size[known] / unit[:, None]) @ left[:, known].T
        return cls(columns, places, left * kept, whitening, inverse)

    def project(self, flat: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
        """Weighted residuals less what the columns can take away."""
        return flat - self.basis @ (self.basis.T @ flat)

    def solve(self, flat: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " linear"]:
        """The parameters that minimise weighted residuals, `flat` where all of them are 0."""
        return -self.pseudo_inverse @ flat
