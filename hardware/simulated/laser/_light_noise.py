"""Noise of the light: phase noise over a delay, intensity noise."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Laser:
    """What the laser adds to its scan.

    - `linewidth_hz`: Lorentzian linewidth dnu_L, Hz. Over a delay tau the phase walks by a variance
      of 2 pi dnu_L tau.
    - `rin_per_hz`: relative intensity noise, one-sided, white to half the sampling rate, 1/Hz.
    - `power_per_ghz`: relative growth of the power along the scan, 1/GHz.

    Defaults: a free-running piezo ECDL seen for about a millisecond (100 kHz, -130 dB/Hz).
    """

    linewidth_hz: float = 1e5
    rin_per_hz: float = 1e-13
    power_per_ghz: float = 0.0

    def __post_init__(self) -> None:
        if not (self.linewidth_hz >= 0 and self.rin_per_hz >= 0):
            raise ValueError(f"Linewidth and intensity noise must not be negative, but are {self}.")

    def rin_rms(self, sample_hz: float) -> float:
        """Rms of the relative intensity noise in the band of a digitizer."""
        return float(np.sqrt(self.rin_per_hz * sample_hz / 2.0))


class PhaseNoise:
    """White frequency noise as an interferometer of one delay and a cavity beside it see it.

    Drawn chunk by chunk. Each sampling interval's walk of the phase has two parts, so that windows
    of `delay_s` that end at neighbouring samples share exactly what they overlap.
    """

    def __init__(
        self, laser: Laser, delay_s: float, sample_hz: float, rng: np.random.Generator
    ) -> None:
        """`delay_s`: of the interferometer, s; `sample_hz`: of the digitizer, Hz."""
        self._rng = rng
        self._whole = int(delay_s * sample_hz)  # sampling intervals within the delay
        rest = delay_s * sample_hz - self._whole
        power = 2.0 * np.pi * laser.linewidth_hz / sample_hz  # rad^2 an interval
        self._late, self._early = np.sqrt(power * rest), np.sqrt(power * (1.0 - rest))
        self._window_s = min(delay_s, 1.0 / sample_hz)
        self._silent = laser.linewidth_hz == 0.0
        self._tail = self._steps(self._whole)

    def _steps(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        late = self._rng.standard_normal(count, dtype=np.float32)
        late *= np.float32(self._late)
        if not self._whole:
            return late, late
        early = self._rng.standard_normal(count, dtype=np.float32)
        early *= np.float32(self._early)
        early += late
        return late, early

    def draw(self, count: int) -> tuple[np.ndarray, np.ndarray] | None:
        """Phase over the delay (rad) and frequency (Hz) at the next samples; `None`: no noise."""
        if self._silent:
            return None
        late, interval = self._steps(count)
        if not self._whole:
            return late, late / np.float32(2.0 * np.pi * self._window_s)
        late = np.concatenate([self._tail[0], late])
        interval = np.concatenate([self._tail[1], interval])
        self._tail = late[-self._whole :], interval[-self._whole :]
        walk = np.cumsum(interval, dtype=np.float64)
        phase = walk[self._whole :] - walk[:count] + late[:count]
        own = interval[self._whole :] / np.float32(2.0 * np.pi * self._window_s)
        return phase.astype(np.float32), own
