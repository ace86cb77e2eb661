"""What a base leaves of the errors, and what of an effect's signature it cannot take up."""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.noise._misfit_covariance import MisfitCovariance
from fitting.diagnosis.refit._gauss_newton import State
from fitting.diagnosis.which._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class BaseRemainder:
    """Whitened errors beyond a base. `reduce`: a change of synchronous errors, less its share."""

    synchronous: Float[np.ndarray, " synchronous"]
    nonsynchronous: Float[np.ndarray, " others"]
    reduce: Callable[[np.ndarray], np.ndarray]

    @classmethod
    def beyond_tangent(
        cls, state: State, basis: Float[np.ndarray, "lines rank"]
    ) -> "BaseRemainder":
        """Of a base whose values are fitted: less all along its tangent, the orthonormal `basis`.

        The errors stay as they are: at the end of a fit none of them lies along it.
        """
        errors = state.errors
        return cls(
            errors.synchronous,
            errors.nonsynchronous,
            lambda change: change - basis @ (basis.T @ change),
        )

    @classmethod
    def beyond_density(cls, state: State, covariance: MisfitCovariance) -> "BaseRemainder":
        """Of a base that is integrated out: whitened by its covariance, in closed form."""
        errors = state.errors
        return cls(covariance.whiten(errors.synchronous), errors.nonsynchronous, covariance.whiten)

    @property
    def excess(self) -> float:
        """Chi-square above what noise alone would leave."""
        parts = self.synchronous, self.nonsynchronous
        return float(sum(part @ part - part.size for part in parts))

    @property
    def nonsynchronous_excess(self) -> float:
        """The same of what does not repeat."""
        return float(self.nonsynchronous @ self.nonsynchronous - self.nonsynchronous.size)


def orthonormal_basis(columns: np.ndarray) -> np.ndarray:
    """Orthonormal columns that span what a base can change."""
    length = np.linalg.norm(columns, axis=0)
    left, size, _ = np.linalg.svd(columns[:, length > 0] / length[length > 0], full_matrices=False)
    return left[:, size > THRESHOLDS.rank_tolerance * size.max(initial=0.0)]
