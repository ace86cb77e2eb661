"""Optics behind the laser: frequency to light on a photodiode, in the photodiode's volts."""

import dataclasses

import numpy as np

from rapi_jax.internal import SPEED_OF_LIGHT

_TWO_PI = np.float32(2.0 * np.pi)


def wrapped_angle(cycles: np.ndarray) -> np.ndarray:
    """The angle (rad, float32) of a number of cycles, of which whole ones are dropped first."""
    return (cycles - np.floor(cycles)).astype(np.float32) * _TWO_PI


@dataclasses.dataclass(frozen=True)
class Interferometer:
    """A Mach-Zehnder interferometer: `v/2 (1 + visibility cos(2 pi nu tau))`.

    - `delay_s`: tau, s. The light's frequency is taken at the time of detection: half a delay
      (12 ns) later than exact.
    - `volts`: at a bright fringe of full visibility, V.
    - `noise_v`: rms noise of the detector in the digitizer's band, V.
    """

    delay_s: float
    volts: float = 0.9
    visibility: float = 0.9
    noise_v: float = 2e-3

    @classmethod
    def fibre(cls, length_m: float = 5.0, index: float = 1.468) -> "Interferometer":
        """One whose arms differ by `length_m` of fibre: 24.5 ns for 5 m."""
        return cls(length_m * index / SPEED_OF_LIGHT)

    def light(self, nu: np.ndarray, noise: np.ndarray | None, phase: float) -> np.ndarray:
        """Photodiode volts at frequencies `nu` (GHz); `noise`: phase over the delay, rad."""
        angle = wrapped_angle(nu * (self.delay_s * 1e9) + phase)
        if noise is not None:
            angle += noise
        signal = np.cos(angle, out=angle)
        signal *= np.float32(self.volts * self.visibility / 2.0)
        signal += np.float32(self.volts / 2.0)
        return signal


@dataclasses.dataclass(frozen=True)
class Cavity:
    """A Fabry-Perot cavity in transmission: the Airy function.

    - `fsr_ghz`: free spectral range, GHz. `finesse`: that over a peak's full width at half height.
    - `offset_ghz`: frequency of the peak of order 0, on the device's own scale, GHz.
    - `volts`: at a peak, V. `noise_v`: rms noise of the detector, V.
    - `jitter_ghz`: rms error with which its comb stands at each end of a branch of the scan, GHz:
      independent at the two ends and from branch to branch, straight between (`CombJitter`). The
      span of a branch read off the comb then errs by sqrt(2) of it.

    The light is taken to fill the cavity at once. Its lifetime (21 ns here) would move all peaks of
    a branch by the same 0.13 MHz at 6 THz/s.
    """

    fsr_ghz: float = 1.5
    finesse: float = 200.0
    offset_ghz: float = 0.37
    volts: float = 0.8
    noise_v: float = 2e-3
    jitter_ghz: float = 0.0

    def light(
        self, nu: np.ndarray, noise: np.ndarray | None, comb: np.ndarray | None = None
    ) -> np.ndarray:
        """Photodiode volts at frequencies `nu` (GHz); `noise`: of the frequency, Hz.

        `comb`: how far the comb is off, GHz.
        """
        offset = self.offset_ghz if comb is None else self.offset_ghz + comb
        angle = wrapped_angle((nu - offset) * (1.0 / self.fsr_ghz))
        if noise is not None:
            angle += noise * np.float32(2e-9 * np.pi / self.fsr_ghz)
        signal = np.cos(angle, out=angle)  # sin^2(x/2) = (1 - cos x)/2
        depth = 0.5 / np.sin(np.pi / (2.0 * self.finesse)) ** 2  # half height at FSR / finesse
        signal *= np.float32(-depth)
        signal += np.float32(1.0 + depth)
        np.divide(np.float32(self.volts), signal, out=signal)
        return signal
