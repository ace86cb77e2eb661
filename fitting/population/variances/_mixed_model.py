r"""Coefficients given the variances: generalised least squares, with small-sample corrections.

With $V_i = T + C_i$ known, $\hat\gamma = S^{-1}b$ has covariance $\Omega = S^{-1}$ (see
`_restricted_likelihood`). As $T$ is estimated, its own covariance $W$, the inverse of the expected
information, enters what is said: Kenward and Roger (1997, Biometrics 53, 983) correct $\Omega$ and
give the degrees of freedom of F-tests, exact for Hotelling's $T^2$ and for balanced designs.

`a, b, c, d` in comments are parameters; $E_{ab}$ is the matrix with a single 1, for which
derivatives with respect to elements of $T$ are taken before they are gathered into those that were
estimated.
"""

import dataclasses
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float


@dataclasses.dataclass(frozen=True, eq=False)
class MixedModel:
    """Estimates, their design and the variance between recordings.

    `design`: coefficients to expectation, `recordings parameters coefficients`. `prior`: precision
    of the coefficients, 0 of fixed effects and 1 of smooth drifts. `tangent`: derivatives of the
    elements of `between` with respect to what of it was estimated, `pairs variances`.
    """

    values: Float[np.ndarray, "recordings parameters"]
    covariances: Float[np.ndarray, "recordings parameters parameters"]
    known: Bool[np.ndarray, "recordings parameters"]
    design: Float[np.ndarray, "recordings parameters coefficients"]
    prior: Float[np.ndarray, " coefficients"]
    between: Float[np.ndarray, "parameters parameters"]
    tangent: Float[np.ndarray, "pairs variances"]

    @property
    def size(self) -> int:
        """Number of parameters."""
        return self.values.shape[1]

    @cached_property
    def weights(self) -> Float[np.ndarray, "recordings parameters parameters"]:
        """Inverse of each recording's total covariance, 0 where there is no estimate."""
        return self._weights_of(self.known)

    def _weights_of(self, known: np.ndarray) -> np.ndarray:
        pair = known[:, :, None] & known[:, None, :]
        total = np.where(pair, self.between + self.covariances, 0.0)
        total += np.einsum("ma,ab->mab", ~known, np.eye(self.size))
        return np.where(pair, np.linalg.inv(total), 0.0)

    @cached_property
    def weighted(self) -> Float[np.ndarray, "recordings parameters coefficients"]:
        """Weights times design."""
        return self.weights @ self.design

    @cached_property
    def terms(self) -> tuple[np.ndarray, np.ndarray]:
        """What each recording adds to the normal equations: their matrix and right-hand side."""
        matrix = np.einsum("mab,mac->mbc", self.design, self.weighted)
        return matrix, np.einsum("mab,ma->mb", self.weighted, self.values)

    @cached_property
    def covariance(self) -> Float[np.ndarray, "coefficients coefficients"]:
        """Covariance of the coefficients if `between` were known."""
        return np.linalg.inv(self.terms[0].sum(axis=0) + np.diag(self.prior))

    @cached_property
    def coefficients(self) -> Float[np.ndarray, " coefficients"]:
        """The generalised least-squares estimate."""
        return self.covariance @ self.terms[1].sum(axis=0)

    @cached_property
    def _products(self) -> Float[np.ndarray, "pairs coefficients coefficients"]:
        """Sum over recordings of outer products of the rows `a` and `b` of `weighted`."""
        out = _pairs(self.weighted, self.weighted).transpose(0, 2, 1, 3)  # [a, b, c, d]
        return out.reshape(self.size**2, *out.shape[2:])

    @cached_property
    def information(self) -> Float[np.ndarray, "variances variances"]:
        """Expected restricted information of what was estimated: tr(P E_r P E_s) / 2."""
        size = self.size
        root = np.linalg.cholesky(self.covariance)
        white = self.weighted @ root
        inside = white @ np.swapaxes(white, 1, 2)
        weights = self.weights
        straight = _pairs(weights, weights) - _pairs(weights, inside) - _pairs(inside, weights)
        outer = _pairs(white, white).transpose(0, 2, 1, 3).reshape(size**2, -1)  # [a b, ...]
        last = (outer @ outer.T).reshape((size,) * 4)  # [d, c, a, b]
        trace = straight.transpose(1, 3, 2, 0) + last.transpose(2, 3, 1, 0)
        return 0.5 * self.tangent.T @ trace.reshape(size**2, size**2) @ self.tangent

    @cached_property
    def variance_covariance(self) -> Float[np.ndarray, "variances variances"]:
        """Covariance of what was estimated of `between`, `W`."""
        return np.linalg.pinv(self.information, rcond=1e-12, hermitian=True)

    @cached_property
    def pair_covariance(self) -> Float[np.ndarray, "pairs pairs"]:
        """`W` for all elements of `between`, [a b, c d]."""
        return self.tangent @ self.variance_covariance @ self.tangent.T

    @cached_property
    def diagonal_stderr(self) -> Float[np.ndarray, " parameters"]:
        """Standard error of the variance of each parameter between recordings."""
        at = np.arange(self.size) * (self.size + 1)
        return np.sqrt(np.maximum(np.diag(self.pair_covariance)[at], 0.0))

    @cached_property
    def corrected_covariance(self) -> Float[np.ndarray, "coefficients coefficients"]:
        """Covariance of the coefficients, `between` being estimated (Kenward and Roger, Eq. 5)."""
        size = self.size
        four = self.pair_covariance.reshape((size,) * 4)
        middle = np.einsum("abcd,mbc->mad", four, self.weights, optimize=True)
        q = np.einsum("mac,mad,mde->ce", self.weighted, middle, self.weighted, optimize=True)
        f = self._products
        mixed = (self.pair_covariance @ f.reshape(size**2, -1)).reshape(f.shape)
        p = np.einsum("rce,cd,rdf->ef", mixed, self.covariance, f, optimize=True)
        omega = self.covariance
        return omega + 2.0 * omega @ (q - 0.5 * (p + p.T)) @ omega

    def degrees(self, contrast: Float[np.ndarray, " coefficients"]) -> float:
        """Degrees of freedom of the variance of a contrast, by Satterthwaite."""
        inside = self.weighted @ (self.covariance @ contrast)
        slope = (inside.T @ inside).ravel()
        variance = float(contrast @ self.covariance @ contrast)
        spread = float(slope @ self.pair_covariance @ slope)
        return 2.0 * variance**2 / spread if spread > 0 else np.inf

    def slopes(
        self, design: Float[np.ndarray, "parameters coefficients"]
    ) -> Float[np.ndarray, "pairs parameters parameters"]:
        """Derivative of a new recording's predictive covariance with respect to `between`."""
        size = self.size
        inside = self.weighted @ (self.covariance @ design.T)
        out = _pairs(inside, inside).transpose(0, 2, 1, 3)  # [a, b, c, d]
        return out.reshape(size**2, size, size) + np.eye(size**2).reshape(size**2, size, size)

    def predictive(
        self, design: Float[np.ndarray, "parameters coefficients"]
    ) -> Float[np.ndarray, "parameters parameters"]:
        """Covariance of a new recording's true parameters about their expectation."""
        return self.between + design @ self.corrected_covariance @ design.T

    def shrunken(
        self, known: Bool[np.ndarray, "recordings parameters"]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Each recording's best linear unbiased prediction, and its standard error.

        `known`: estimates to use of the recording itself, also where the model has no part of it.
        """
        gain = self.between @ self._weights_of(known)
        left = np.where(known, self.values - self.design @ self.coefficients, 0.0)
        values = self.design @ self.coefficients + np.einsum("mab,mb->ma", gain, left)
        rest = self.design - gain @ self.design
        own = self.between - gain @ self.between
        own = own + rest @ self.corrected_covariance @ np.swapaxes(rest, 1, 2)
        return values, np.sqrt(np.maximum(np.einsum("maa->ma", own), 0.0))


def _pairs(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Sum over recordings of the products of two matrices' elements: `[a, b, c, d]`."""
    flat = one.reshape(len(one), -1).T @ other.reshape(len(other), -1)
    return flat.reshape(*one.shape[1:], *other.shape[1:])
