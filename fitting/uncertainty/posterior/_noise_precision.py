r"""The precision of stationary noise, exactly, in a few transforms.

The covariance $T$ of $n$ evenly spaced readings is Toeplitz. With $x$ the first column of $T^{-1}$
and $y = (0, x_n, \dots, x_2)$,
$$T^{-1} = (L_x L_x' - L_y L_y') / x_1,$$
$L$ lower triangular Toeplitz with the first column named (I. Gohberg and A. Semencul, Mat. Issled.
7, 201, 1972). So $r'T^{-1}r$ takes three transforms of $r$, whatever the noise.
"""

from collections.abc import Sequence

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Int

from rapi_jax import ModelError


class NoisePrecision(eqx.Module):
    """The precision of the noise of all runs; a run's readings count as evenly spaced.

    - `place`: of each used sample among the samples "runs time", row by row, padded with the first.
    - `inside`: 1 for a used sample, 0 for padding.
    - `lower`, `upper`: transforms of `x` and `y`, conjugate, each over the root of `x_1`.
    """

    place: Int[Array, "runs longest"]
    inside: Float[Array, "runs longest"]
    lower: Complex[Array, "runs waves"]
    upper: Complex[Array, "runs waves"]
    size: int = eqx.field(static=True)

    def square(self, error: Float[Array, "runs time"]) -> Float[Array, ""]:
        """`e' T^-1 e` over all runs."""
        wave = jnp.fft.rfft(self.cut(error), self.size, axis=1)
        longest = self.place.shape[1]
        parts = (
            jnp.fft.irfft(factor * wave, self.size, axis=1)[:, :longest]
            for factor in (self.lower, self.upper)
        )
        plus, minus = (jnp.sum(self.inside * part**2) for part in parts)
        return plus - minus

    def cut(self, error: Float[Array, "runs time"]) -> Float[Array, "runs longest"]:
        """The used samples of each run, 0 in the padding."""
        return jnp.take_along_axis(error, self.place, axis=1) * self.inside

    @classmethod
    def of(
        cls, use: np.ndarray, autocovariances: Sequence[Float[np.ndarray, " _"]]
    ) -> "NoisePrecision":
        """From the samples that are used and each run's autocovariance, from lag 0 on.

        Raises `ModelError` where a run has no noise.
        """
        counts = use.sum(axis=1)
        longest = int(counts.max())
        size = 1 << int(np.ceil(np.log2(2 * longest)))
        place = np.zeros((counts.size, longest), dtype=np.int32)
        inside = np.zeros((counts.size, longest))
        lower, upper = (np.zeros((counts.size, size // 2 + 1), dtype=complex) for _ in range(2))
        for row, (count, gamma) in enumerate(zip(counts, autocovariances, strict=True)):
            place[row, :count] = np.flatnonzero(use[row])
            inside[row, :count] = 1.0
            x = solve_noise(gamma, np.eye(count, 1)[:, 0])
            y = np.concatenate([[0.0], x[:0:-1]])
            for out, column in ((lower, x), (upper, y)):
                out[row] = np.conj(np.fft.rfft(column, size)) / np.sqrt(x[0])
        first, second, third, fourth = map(jnp.asarray, (place, inside, lower, upper))
        return cls(first, second, third, fourth, size)


def solve_noise(gamma: Float[np.ndarray, " time"], columns: np.ndarray) -> np.ndarray:
    """`T^-1 columns`, by Levinson's recursion; white noise without it."""
    from scipy.linalg import solve_toeplitz

    if not gamma[0] > 0:
        raise ModelError(
            "a run's residuals hold no noise, so there is no likelihood. A fit without noise "
            "leaves nothing to be uncertain of."
        )
    if not gamma[1:].any():
        return columns / gamma[0]
    return np.asarray(solve_toeplitz(gamma, columns))
