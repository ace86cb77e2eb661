r"""A smooth drift: a Gaussian process in time, by its eigenfunctions at the recordings.

Matern's covariance of order 3/2, $k(s) = (1 + \sqrt3 s/\ell)\,e^{-\sqrt3 s/\ell}$ (Rasmussen and
Williams 2006, Eq. 4.17), at the times of the recordings has eigenvectors $U$ and eigenvalues $S$;
$U S^{1/2}$ times standard normal coefficients is the process there, and $k(t, \cdot)\,U S^{-1/2}$
times the same coefficients its conditional mean elsewhere.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.population._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class SmoothDrift:
    """A process of unit variance in standardised time.

    `length`: of its correlation. `values`: eigenfunctions at the recordings. `factor`: gives them
    at other times.
    """

    times: Float[np.ndarray, " recordings"]
    length: float
    values: Float[np.ndarray, "recordings functions"]
    factor: Float[np.ndarray, "recordings functions"]

    @classmethod
    def of(cls, times: Float[np.ndarray, " recordings"], length: float) -> "SmoothDrift":
        """The leading eigenfunctions at `times`."""
        variances, vectors = np.linalg.eigh(matern(times[:, None] - times, length))
        lead = slice(-min(THRESHOLDS.smooth_rank, times.size), None)
        variances, vectors = np.maximum(variances[lead], 0.0), vectors[:, lead]
        keep = variances > 1e-10 * variances.max(initial=0.0)
        inverse = np.where(keep, 1.0 / np.sqrt(np.where(keep, variances, 1.0)), 0.0)
        return cls(times, length, vectors * np.sqrt(variances), vectors * inverse)

    def at(self, time: float) -> tuple[Float[np.ndarray, " functions"], float]:
        """The eigenfunctions at a time, and the variance of the process that they leave there."""
        row = matern(time - self.times, self.length) @ self.factor
        return row, float(max(1.0 - row @ row, 0.0))


def matern(lag: np.ndarray, length: float) -> np.ndarray:
    """Covariance at `lag`, in the unit of `length`."""
    scaled = np.sqrt(3.0) * np.abs(lag) / length
    return (1.0 + scaled) * np.exp(-scaled)
