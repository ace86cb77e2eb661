"""What linear effects make of a small change of the response that they stand behind."""

import dataclasses

import numpy as np
from jaxtyping import Complex, Float


@dataclasses.dataclass(frozen=True, eq=False)
class LinearPath:
    """Transfer functions of all runs, whose samples stand one after the other.

    `size`: samples of each run. `transfer`: of each run, at the frequencies of its real Fourier
    transform. A run is taken to repeat.
    """

    size: tuple[int, ...]
    transfer: tuple[Complex[np.ndarray, " _"], ...]

    def adjoint(self, reading: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
        """The change of the response that correlates with all changes as `reading` does behind."""
        parts = np.split(reading, np.cumsum(self.size)[:-1])
        return np.concatenate(
            [
                np.fft.irfft(np.fft.rfft(part) * np.conj(transfer), part.size)
                for part, transfer in zip(parts, self.transfer, strict=True)
            ]
        )

    def power(
        self, drive: Float[np.ndarray, " samples"], cycles: Float[np.ndarray, " waves"]
    ) -> Float[np.ndarray, " waves"]:
        """About the summed square of what is read of waves over a drive, of so many cycles a unit.

        As if each run moved by its median step all the time, as a triangle nearly does.
        """
        total = np.zeros(cycles.size)
        parts = np.split(drive, np.cumsum(self.size)[:-1])
        for part, transfer in zip(parts, self.transfer, strict=True):
            turns = cycles * float(np.median(np.abs(np.diff(part)))) if part.size > 1 else 0.0
            folded = np.abs(turns - np.round(turns))  # cycles a sample, up to a half
            line = np.linspace(0.0, 0.5, transfer.size)
            total += part.size * np.interp(folded, line, np.abs(transfer) ** 2)
        return total
