r"""Recordings against a reference set of others: what was to be expected, and how far off each is.

Recording $i$ has the estimate $x_i$ with covariance $C_i$; between recordings parameters scatter
with covariance $T$, so that $x_i$ has $T + C_i$. The members of the reference set have the weighted
covariance $S$, of which $T + \bar C$ is the expectation. A recording outside the set is expected
within $S (1 + 1/m) + (C_i - \bar C)_+$: a noisier one has more room, by what its covariance exceeds
the mean one; one that is less noisy than the others has no less room, because how $S$ divides into
$T$ and $\bar C$ is poorly known. With equal covariances this is Hotelling's prediction, exactly.
"""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.batch.table._thresholds import THRESHOLDS

_ROWS = 512  # recordings worked on at once: 1.3 MB a matrix of 18 parameters


@dataclasses.dataclass(frozen=True)
class Prediction:
    """Each recording against the reference set without it.

    - `error`: its parameters less the mean; `variance`: what these were to be expected to have.
    - `square`: the squared Mahalanobis distance of all of them together.
    - `size`: the number of equally weighted recordings that the reference set is worth.
    """

    error: Float[np.ndarray, "recordings parameters"]
    variance: Float[np.ndarray, "recordings parameters"]
    square: Float[np.ndarray, " recordings"]
    size: Float[np.ndarray, " recordings"]


@dataclasses.dataclass(frozen=True)
class Reference:
    r"""Mean and covariance of the members; any one of them can be taken out again.

    Parameters are in units in which they scatter by about 1.
    `weight` is 0 for a recording that is no member; `noise` is the mean covariance of the
    estimates, $\bar C$.
    """

    weight: Float[np.ndarray, " recordings"]
    mean: Float[np.ndarray, " parameters"]
    covariance: Float[np.ndarray, "parameters parameters"]
    noise: Float[np.ndarray, "parameters parameters"]

    @classmethod
    def of(
        cls,
        x: Float[np.ndarray, "recordings parameters"],
        c: Float[np.ndarray, "recordings parameters parameters"],
        member: Float[np.ndarray, " recordings"],
    ) -> "Reference":
        """The set of members (1, and 0 for others); those that are noisier weigh less."""
        plain = cls._weigh(x, c, member)
        variance = np.diag(plain.covariance)
        more = np.diagonal(c, axis1=1, axis2=2) - np.diag(plain.noise)
        room = np.max(np.maximum(more, 0.0) / variance, axis=1)
        return cls._weigh(x, c, member / (1.0 + room))

    @classmethod
    def _weigh(cls, x: np.ndarray, c: np.ndarray, weight: np.ndarray) -> "Reference":
        weight = weight / weight.sum()
        mean = weight @ x
        off = x - mean
        share = weight * (1.0 - weight)
        covariance = (weight[:, None] * off).T @ off / share.sum()
        covariance += THRESHOLDS.rank * np.eye(len(mean))
        return cls(weight, mean, covariance, np.tensordot(share / share.sum(), c, 1))

    def scatter(self) -> Float[np.ndarray, " parameters"]:
        """Standard deviation between recordings, beyond what standard errors explain."""
        return np.sqrt(np.maximum(np.diag(self.covariance) - np.diag(self.noise), 0.0))

    def predict(
        self,
        x: Float[np.ndarray, "recordings parameters"],
        c: Float[np.ndarray, "recordings parameters parameters"],
    ) -> Prediction:
        """Each recording against the members other than itself."""
        factor = np.linalg.inv(np.linalg.cholesky(self.covariance))
        parts = [
            self._predict(x[at], c[at], self.weight[at], factor)
            for at in (slice(i, i + _ROWS) for i in range(0, len(x), _ROWS))
        ]
        names = [field.name for field in dataclasses.fields(Prediction)]
        return Prediction(**{n: np.concatenate([getattr(p, n) for p in parts]) for n in names})

    def _predict(
        self, x: np.ndarray, c: np.ndarray, own: np.ndarray, factor: np.ndarray
    ) -> Prediction:
        total2 = np.sum(self.weight**2)
        left, left2 = 1.0 - own, total2 - own**2
        size = left**2 / left2
        # The covariance without the recording is that of all, scaled, less a multiple of its own.
        inflation = (1.0 + 1.0 / size) / (left - left2 / left)
        scale, less = inflation * (1.0 - total2), inflation * own / left
        off = x - self.mean
        error = off / left[:, None]
        more = np.diagonal(c - self.noise, axis1=1, axis2=2)
        variance = scale[:, None] * np.diag(self.covariance) - less[:, None] * off**2
        room, basis = np.linalg.eigh(factor @ (c - self.noise) @ factor.T)
        along = np.einsum("ikj,ik->ij", basis, off @ factor.T)
        q = np.sum(along**2 / (scale[:, None] + np.maximum(room, 0.0)), axis=1)
        rest = np.maximum(1.0 - less * q, np.finfo(float).eps)
        return Prediction(
            error=error,
            variance=np.maximum(variance, np.finfo(float).tiny) + np.maximum(more, 0.0),
            square=q / rest / left**2,
            size=size,
        )

    def given_others(
        self, x: Float[np.ndarray, " parameters"], c: Float[np.ndarray, "parameters parameters"]
    ) -> Float[np.ndarray, " parameters"]:
        """How far off each parameter of one recording is, given its others, in standard deviations.

        The recording is no member. From the precision matrix (Lauritzen 1996, *Graphical Models*).
        """
        lower = np.linalg.cholesky(self.covariance)
        factor = np.linalg.inv(lower)
        room, basis = np.linalg.eigh(factor @ (c - self.noise) @ factor.T)
        wide = lower @ basis
        expected = self.covariance + (wide * np.maximum(room, 0.0)) @ wide.T
        precision = np.linalg.inv(expected)
        return precision @ (x - self.mean) / np.sqrt(np.diag(precision))
