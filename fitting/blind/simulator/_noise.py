"""Reading noise: white and coloured, then rounded to the reading's step."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import signal

Array = npt.NDArray[np.float64]
LEAST, MOST = 0.005, 0.030  # GHz rms


@dataclass(frozen=True)
class Noise:
    """Noise of one recording, in GHz. The coloured part is a sum of equal first-order processes.

    One correlation time makes AR(1) noise; several, spread over decades, make nearly 1/f noise.
    """

    white: float  # rms
    coloured: float  # rms
    taus: tuple[float, ...]  # s
    step: float  # of the reading

    @property
    def rms(self) -> float:
        """Of a sample, rounding included, GHz."""
        return float(np.sqrt(self.white**2 + self.coloured**2 + self.step**2 / 12))

    def scaled(self, factor: float) -> "Noise":
        """The same noise, `factor` times as large."""
        return Noise(factor * self.white, factor * self.coloured, self.taus, factor * self.step)

    def drawn(self, rng: np.random.Generator, count: int, step_s: float) -> Array:
        """`count` values at one sampling step, before rounding, GHz."""
        noise = self.white * rng.standard_normal(count)
        each = self.coloured / np.sqrt(len(self.taus))
        for tau in self.taus:
            a = float(np.exp(-step_s / tau))
            fresh = rng.standard_normal(count + 1)
            kicks = each * np.sqrt(1 - a * a) * fresh[1:]
            noise += np.asarray(signal.lfilter([1.0], [1, -a], kicks, zi=[a * each * fresh[0]])[0])
        return noise

    def read(self, nu: Array, rng: np.random.Generator, step_s: float) -> Array:
        """Readings of noise-free frequencies `nu`."""
        return self.step * np.round((nu + self.drawn(rng, len(nu), step_s)) / self.step)


def draw_noise(rng: np.random.Generator) -> Noise:
    """5 to 30 MHz in all, up to half of it coloured, steps of 1 MHz to a third of the rms."""
    rms = float(np.exp(rng.uniform(np.log(LEAST), np.log(MOST))))
    step = float(np.exp(rng.uniform(np.log(0.001), np.log(rms / 3))))
    part = float(rng.uniform(0.05, 0.5))
    if rng.random() < 0.5:
        taus = (float(np.exp(rng.uniform(np.log(2e-4), np.log(5e-3)))),)
    else:
        taus = (3e-4, 3e-3, 3e-2)
    left = rms**2 - step**2 / 12
    return Noise(float(np.sqrt(left * (1 - part))), float(np.sqrt(left * part)), taus, step)
