r"""Stationary noise as a sum of few processes, whose variances are all that is to be known.

White noise; relaxations; flicker noise. A relaxation of corner $f_c$ read every $h$ is an AR(1)
process with correlation $\rho = e^{-2\pi f_c h}$ from sample to sample. Flicker noise is a sum of
relaxations with corners at equal ratios (A. van der Ziel, Physica 16, 359, 1950).
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Processes:
    """Processes of variance 1 that noise may be made of, as sums of relaxations.

    - `corner_hz`: of the relaxations, rising. `shares`: the variance that each process (rows) has
      in white noise (first column) and in each relaxation.
    """

    corner_hz: Float[np.ndarray, " relaxations"]
    shares: Float[np.ndarray, "processes components"]

    @classmethod
    def of(
        cls, steps_s: Sequence[float], sizes: Sequence[int], slowest_hz: float = 0.0
    ) -> "Processes":
        """White noise, each relaxation, and flicker noise of several exponents.

        Corners lie between what the longest run and what the finest sampling can show, and not
        below `slowest_hz`.
        """
        longest = max(step * size for step, size in zip(steps_s, sizes, strict=True))
        slowest = max(THRESHOLDS.slowest_corner / longest, slowest_hz)
        fastest = max(THRESHOLDS.fastest_corner / min(steps_s), 2.0 * slowest)
        ratio = np.log(fastest / slowest) / np.log(THRESHOLDS.corner_ratio)
        corner_hz = np.geomspace(slowest, fastest, 1 + int(np.ceil(ratio)))
        exponents = np.array(THRESHOLDS.flicker_exponents)[:, None]
        flicker = (corner_hz / slowest) ** (1.0 - exponents)
        flicker /= flicker.sum(axis=1, keepdims=True)
        single = np.eye(corner_hz.size + 1)
        return cls(corner_hz, np.concatenate([single, np.pad(flicker, ((0, 0), (1, 0)))]))

    def autocovariance(self, step_s: float, lags: int) -> Float[np.ndarray, "processes lags"]:
        """The autocovariance of each process sampled every `step_s`, at lags 0 to `lags` - 1."""
        each = np.zeros((self.corner_hz.size + 1, lags))
        each[0, 0] = 1.0
        each[1:] = np.exp(-2.0 * np.pi * self.corner_hz[:, None] * step_s * np.arange(lags))
        return self.shares @ each

    def spectrum(
        self, hertz: Float[np.ndarray, " frequencies"], step_s: float
    ) -> Float[np.ndarray, "processes frequencies"]:
        """The variance a sample of each process at each frequency, in a long record."""
        rho = np.exp(-2.0 * np.pi * self.corner_hz * step_s)[:, None]
        turn = np.cos(2.0 * np.pi * hertz * step_s)
        each = (1.0 - rho**2) / (1.0 - 2.0 * rho * turn + rho**2)
        return self.shares @ np.concatenate([np.ones((1, turn.size)), each])

    def pick(self, these: Int[np.ndarray, " chosen"]) -> "Processes":
        """Some of the processes, and of the relaxations those that they are made of."""
        shares = self.shares[these]
        used = shares[:, 1:].any(axis=0)
        return Processes(self.corner_hz[used], shares[:, np.concatenate([[True], used])])

    def periodogram(self, step_s: float, size: int) -> Float[np.ndarray, "processes lines"]:
        """The expected power of each process at each Fourier line; 1 for white noise.

        A line of a short record holds more than the spectrum there: it is smoothed by Fejer's
        kernel, as the triangle over the lags says (Sykulski et al., Biometrika 106, 251, 2019).
        """
        each = self.autocovariance(step_s, size) * (1.0 - np.arange(size) / size)
        each[:, 1:] += each[:, :0:-1].copy()
        return np.maximum(np.fft.rfft(each, axis=1).real, 0.0)


@dataclasses.dataclass(frozen=True, eq=False)
class NoiseModel:
    """The noise of a recording's runs.

    - `processes`, `variance`: of each process in each run, in the response's unit squared.
    - `step_s`: the sampling interval of each run. Where the noise is the same from sample to sample
      and not from second to second, that of the finest in all.
    """

    processes: Processes
    variance: Float[np.ndarray, "runs processes"]
    step_s: tuple[float, ...]

    def autocovariance(self, run: int, lags: int) -> Float[np.ndarray, " lags"]:
        """Of the samples of run `run`, at lags 0 to `lags` - 1."""
        return self.variance[run] @ self.processes.autocovariance(self.step_s[run], lags)
