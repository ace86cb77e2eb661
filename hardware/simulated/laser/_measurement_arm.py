"""The measurement arm of a ranging set-up: a two-beam interferometer that looks at a target."""

import dataclasses
import itertools

import numpy as np

from rapi_jax.ranging import AirState

from ._optics import SPEED_OF_LIGHT, wrapped_angle
from .motion._target import Target


@dataclasses.dataclass(frozen=True)
class Reflector:
    """Another reflection in the arm: a window, a lens, a second surface.

    - `offset_m`: its distance less the target's, m. `amplitude`: of its field, relative to the
      target's. `moving`: with the target; otherwise at rest.
    """

    offset_m: float
    amplitude: float
    moving: bool = True


@dataclasses.dataclass(frozen=True)
class MeasurementArm:
    r"""`v/2 (1 + visibility cos(2 pi nu tau))` with the absolute frequency nu and tau = 2 n L / c.

    A target that moves by half a wavelength moves the fringes by one.

    - `wavelength_m`: of the laser in vacuum where its scan is 0 GHz, m.
    - `index`, `group_index`: of the air there. Fringes of the scan count the group index, those of
      motion the index: the phase in cycles is `2 L (index nu_0 + group_index nu) / c`. The term in
      `nu^2` is below 1e-5 cycles over 100 GHz and 10 m.
    - `air`: what records say of the air; the caller takes the indices from it.
    - `reflectors`: others beside the target, each interfering with the reference; with `between`,
      with each other and the target too, as for a measurement beam that is weaker than the
      reference.
    - `volts`: at a bright fringe of full visibility, V. `noise_v`: rms noise of the detector, V.

    Left out: the light's travel time, in which frequency and target are taken to rest. Against the
    auxiliary interferometer that is half the difference of the delays, 10 ns: 5e-4 rad at
    1.5 THz/s, the same all along a straight branch. Reflectors share the target's phase noise.
    """

    target: Target
    wavelength_m: float = 780e-9
    index: float = 1.0
    group_index: float = 1.0
    air: AirState | None = None
    reflectors: tuple[Reflector, ...] = ()
    between: bool = False
    volts: float = 0.9
    visibility: float = 0.9
    noise_v: float = 2e-3

    def __post_init__(self) -> None:
        if not (self.wavelength_m > 0 and self.index >= 1 and self.group_index >= 1):
            raise ValueError(
                f"Wavelength and indices must be those of light in air, unlike {self}."
            )
        if not (0 <= self.visibility <= 1 and self.volts > 0 and self.noise_v >= 0):
            raise ValueError(f"A visibility lies between 0 and 1, volts are positive: {self}.")

    @property
    def optical_hz(self) -> float:
        """Frequency of the light where the scan is 0, Hz."""
        return SPEED_OF_LIGHT / self.wavelength_m

    def delay_s(self, session_s: float) -> float:
        """Delay of the target's light (group index) at a session time, s."""
        return float(2.0 * self.group_index * self.target.distance(session_s) / SPEED_OF_LIGHT)

    def cycles(self, nu: np.ndarray, distance: np.ndarray | float) -> np.ndarray:
        """Phase of fringes at scan frequencies `nu` (GHz) and distances (m), cycles."""
        cycles = nu * (2e9 * self.group_index / SPEED_OF_LIGHT)
        cycles += 2.0 * self.index / self.wavelength_m
        cycles *= distance
        return cycles

    def light(
        self, nu: np.ndarray, displacement: np.ndarray | None, noise: np.ndarray | None
    ) -> np.ndarray:
        """Photodiode volts at frequencies `nu` (GHz).

        `displacement`: of the target, m; `noise`: phase over the target's delay, rad.
        """
        angles, amplitudes = [], [1.0, *(one.amplitude for one in self.reflectors)]
        for one in (Reflector(0.0, 1.0), *self.reflectors):
            distance = self.target.distance_m + one.offset_m
            if one.moving and displacement is not None:
                distance = distance + displacement
            angle = wrapped_angle(self.cycles(nu, distance))
            if noise is not None:
                angle += noise
            angles.append(angle)
        signal = np.zeros(nu.size, dtype=np.float32)
        if self.between:
            # Share of the measurement beam in all light, for this visibility and no other beam.
            share = (1.0 - np.sqrt(1.0 - self.visibility**2)) / 2.0
            for one, other in itertools.combinations(range(len(angles)), 2):
                beat = np.cos(angles[one] - angles[other])
                beat *= np.float32(2.0 * share * amplitudes[one] * amplitudes[other])
                signal += beat
        for angle, amplitude in zip(angles, amplitudes, strict=True):
            beat = np.cos(angle, out=angle)
            beat *= np.float32(self.visibility * amplitude)
            signal += beat
        signal += np.float32(1.0)
        signal *= np.float32(self.volts / 2.0)
        return signal
