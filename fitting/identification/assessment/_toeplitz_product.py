"""Products of a matrix with the covariance matrix of a stationary process, which is Toeplitz."""

import dataclasses

import numpy as np
from jaxtyping import Float


@dataclasses.dataclass(frozen=True, eq=False)
class ToeplitzProduct:
    """The columns of a matrix `J` by frequency, padded so that no lag wraps round.

    `waves` holds real and imaginary parts, scaled so that products summed over them are those
    summed over samples.
    """

    size: int
    waves: Float[np.ndarray, "columns waves"]

    @classmethod
    def of(cls, matrix: Float[np.ndarray, "time columns"]) -> "ToeplitzProduct":
        """Transform the columns."""
        size = _fast_length(2 * matrix.shape[0])
        wave = np.fft.rfft(np.ascontiguousarray(matrix.T), size, axis=1)
        share = np.full(wave.shape[1], 2.0 / size)
        share[0] = share[-1] = 1.0 / size
        waves = np.concatenate([wave.real, wave.imag], axis=1) * np.sqrt(np.tile(share, 2))
        return cls(size, waves)

    def middle(self, gamma: Float[np.ndarray, " time"]) -> Float[np.ndarray, "columns columns"]:
        """`J'CJ`, for the autocovariance `gamma` from lag 0 on."""
        around = np.zeros(self.size)
        around[: gamma.size] = gamma
        around[self.size - gamma.size + 1 :] = gamma[:0:-1]
        density = np.tile(np.fft.rfft(around).real, 2)
        return (self.waves * density) @ self.waves.T


def _fast_length(least: int) -> int:
    """The smallest size from `least` on that is even and has no prime factor above 5.

    SciPy's `next_fast_len` would do; to import it takes 0.07 s of a first fit.
    """
    odd = [3**i * 5**k for i in range(3) for k in range(3)]
    return min(factor << max(1, int(np.ceil(np.log2(least / factor)))) for factor in odd)
