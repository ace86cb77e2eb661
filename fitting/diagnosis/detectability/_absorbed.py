"""What of an effect's signature the flexible base would absorb, to first order."""

import dataclasses

import numpy as np
from jaxtyping import Float

_RANK = 1e-12  # of the largest eigenvalue: rounding


@dataclasses.dataclass(frozen=True, eq=False)
class AbsorbedByBase:
    """Derivative of the synchronous errors by the base's values, and the inverse normal matrix.

    Priors of the values count as data.
    """

    jacobian: Float[np.ndarray, "lines values"]
    inverse: Float[np.ndarray, "values values"]

    @classmethod
    def of(
        cls, jacobian: Float[np.ndarray, "lines values"], prior_std: Float[np.ndarray, " values"]
    ) -> "AbsorbedByBase":
        """`jacobian`: 0 where a value is held. `prior_std`: infinite where there is no prior."""
        normal = jacobian.T @ jacobian + np.diag(prior_std**-2.0)
        length = np.sqrt(np.diag(normal))
        unit = np.where(length > 0, length, 1.0)
        scaled = np.linalg.pinv(normal / unit[:, None] / unit[None, :], _RANK, hermitian=True)
        return cls(jacobian, scaled / unit[:, None] / unit[None, :])

    def left(self, signature: Float[np.ndarray, " lines"]) -> float:
        """By how much chi-square rises that the base does not take away."""
        along = self.jacobian.T @ signature
        return max(float(signature @ signature - along @ self.inverse @ along), 0.0)
