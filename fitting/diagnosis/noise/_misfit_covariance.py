"""Covariance of whitened errors where the base is not quite the device's, beyond noise."""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Float


@dataclasses.dataclass(frozen=True, eq=False)
class MisfitCovariance:
    r"""$I + U\,\mathrm{diag}(v)\,U'$ of synchronous errors that noise alone would make white.

    `directions`: $U$, orthonormal. `variance`: $v$; infinite for what the base's own values do.
    """

    directions: Float[np.ndarray, "lines rank"]
    variance: Float[np.ndarray, " rank"]

    @cached_property
    def _removed(self) -> Float[np.ndarray, " rank"]:
        return 1.0 - 1.0 / np.sqrt(1.0 + self.variance)

    @property
    def log_determinant(self) -> float:
        """Of its finite part."""
        return float(np.log1p(self.variance[np.isfinite(self.variance)]).sum())

    def whiten(self, errors: Float[np.ndarray, "*more lines"]) -> Float[np.ndarray, "*more lines"]:
        """The errors with unit covariance; without what has infinite variance."""
        along = errors @ self.directions
        return errors - (along * self._removed) @ self.directions.T
