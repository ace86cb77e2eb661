"""Products of a matrix's columns with lagged copies of each other, weighted by an autocovariance.

A stationary process of autocovariance `gamma` has the covariance matrix `C` (Toeplitz). With the
columns of `J` transformed once, `J'CJ` and the lagged sums of `C J` with `J` are weighted sums over
frequencies, but for the few rows that a lag moves out of the record.
"""

import dataclasses
import functools

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view


@dataclasses.dataclass(frozen=True, eq=False)
class LaggedProducts:
    """The columns of `matrix` by frequency, for lags 0 to `lags`.

    `waves` holds real and imaginary parts, scaled so that products summed over them are those
    summed over samples; `cosine` the phase of each lag at each of them.
    """

    matrix: Float[np.ndarray, "time columns"]
    lags: int
    size: int
    waves: Float[np.ndarray, "columns waves"]
    cosine: Float[np.ndarray, "waves lags"]

    @classmethod
    def of(cls, matrix: Float[np.ndarray, "time columns"], lags: int) -> "LaggedProducts":
        """Transform the columns, padded so that no lag wraps round."""
        size = _fast_length(2 * (matrix.shape[0] + lags))
        wave = np.fft.rfft(np.ascontiguousarray(matrix.T), size, axis=1)
        share = np.full(wave.shape[1], 2.0 / size)
        share[0] = share[-1] = 1.0 / size
        waves = np.concatenate([wave.real, wave.imag], axis=1) * np.sqrt(np.tile(share, 2))
        return cls(matrix, lags, size, waves, _cosine(size, lags))

    @property
    def length(self) -> int:
        """How many lags of an autocovariance are needed."""
        return self.matrix.shape[0] + self.lags

    def density(self, gamma: Float[np.ndarray, " length"]) -> Float[np.ndarray, " waves"]:
        """The spectral density of an autocovariance that is zero at greater lags."""
        around = np.zeros(self.size)
        around[: gamma.size] = gamma
        around[self.size - gamma.size + 1 :] = gamma[:0:-1]
        return np.tile(np.fft.rfft(around).real, 2)

    def middle(self, density: Float[np.ndarray, " waves"]) -> Float[np.ndarray, "columns columns"]:
        """`J'CJ`."""
        return (self.waves * density) @ self.waves.T

    def power(self, form: Float[np.ndarray, "columns columns"]) -> Float[np.ndarray, " waves"]:
        """The quadratic form of the columns at each frequency."""
        return ((form @ self.waves) * self.waves).sum(axis=0)

    def traces(self, power: Float[np.ndarray, " waves"]) -> Float[np.ndarray, " lags"]:
        """Sums over samples and columns of `(J form)[t] J[t + k]`, for each lag k."""
        return power @ self.cosine

    def correlated_traces(
        self,
        form: Float[np.ndarray, "columns columns"],
        power: Float[np.ndarray, " waves"],
        gamma: Float[np.ndarray, " length"],
        density: Float[np.ndarray, " waves"],
    ) -> Float[np.ndarray, " lags"]:
        """The same of `J form` with `C J`, and of `C J` with `J form`, added.

        `form` is symmetric, and `power` its quadratic form.
        """
        total = 2.0 * self.traces(power * density)
        n, lags = self.matrix.shape[0], self.lags
        if not lags:
            return total
        # What the transform takes for `C J` before the first sample, and after the last.
        windows = sliding_window_view(gamma[1:], n)[:lags]
        before, after = windows @ self.matrix, windows @ self.matrix[::-1]
        first, last = self.matrix[:lags] @ form, self.matrix[: -lags - 1 : -1] @ form
        outside = first @ before.T + last @ after.T  # [steps inside, steps outside less one]
        for k in range(1, lags + 1):
            total[k] -= np.trace(outside[:k, :k][:, ::-1])
        return total


@functools.lru_cache(maxsize=8)
def _cosine(size: int, lags: int) -> Float[np.ndarray, "waves lags"]:
    turn = 2.0 * np.pi / size * np.outer(np.arange(size // 2 + 1), np.arange(lags + 1))
    return np.tile(np.cos(turn), (2, 1))


def _fast_length(least: int) -> int:
    """The smallest size from `least` on that is even and has no prime factor above 5.

    SciPy's `next_fast_len` would do; to import it takes 0.07 s of a first fit.
    """
    odd = [3**i * 5**k for i in range(3) for k in range(3)]
    return min(factor << max(1, int(np.ceil(np.log2(least / factor)))) for factor in odd)
