"""Fourier lines of whole periods: which of them repeat with the scan.

The discrete Fourier transform of `P` whole periods puts all that repeats with the scan into every
`P`-th line and nothing else there but noise; all other lines hold what does not repeat.
"""

import dataclasses

import numpy as np
from jaxtyping import Bool, Complex, Float

from ._periods import PeriodBlock


@dataclasses.dataclass(frozen=True, eq=False)
class SpectralLines:
    """The lines of a block's transform.

    - `size`: values of the block. `synchronous`: whether a line repeats with the scan.
    - `multiplicity`: 2 for a line with real and imaginary part, 1 for the mean and Nyquist's.
    """

    hertz: Float[np.ndarray, " lines"]
    step_s: float
    size: int
    synchronous: Bool[np.ndarray, " lines"]
    multiplicity: Float[np.ndarray, " lines"]

    @classmethod
    def of(cls, block: PeriodBlock) -> "SpectralLines":
        """The lines of a block."""
        k = np.arange(block.size // 2 + 1)
        synchronous = k % block.periods == 0
        multiplicity = np.where((k == 0) | (2 * k == block.size), 1.0, 2.0)
        hertz = k / (block.size * block.step_s)
        return cls(hertz, block.step_s, block.size, synchronous, multiplicity)


def to_lines(values: Float[np.ndarray, "*more periods phases"]) -> Complex[np.ndarray, "*more _"]:
    """Fourier lines, scaled so that noise of variance v has power v."""
    flat = values.reshape(*values.shape[:-2], -1)
    return np.fft.rfft(flat, axis=-1) / np.sqrt(flat.shape[-1])
