"""Fringes of a scan with known distance, from the equations alone: an oracle of ranging."""

import dataclasses
from collections.abc import Callable

import numpy as np

from rapi_jax.ranging import FringeRecord, FringeRecords

C = 299_792_458.0  # m/s


@dataclasses.dataclass(frozen=True)
class FringeScans:
    """A triangular scan of optical frequency and what three photodiodes see of it.

    `bend`: curvature of each branch, up and down, as a part of the span; frequencies in Hz.
    """

    span_hz: float = 75e9
    rate_hz: float = 10.0
    sample_hz: float = 1e6
    path_m: float = 7.34
    spacing_hz: float = 1.5e9
    finesse: float = 200.0
    wavelength_m: float = 780e-9
    bend: tuple[float, float] = (0.0, 0.0)
    first_turn_s: float = 0.0  # of a minimum
    noise: float = 2e-3
    rounding_s: float = 0.0
    origin_hz: float = 0.21e9
    cavity: bool = True

    def frequency(self, t: np.ndarray) -> np.ndarray:
        """Hz from the lowest, at times t (s)."""
        phase = np.mod((t - self.first_turn_s) * self.rate_hz, 1.0)
        up, down = 2 * phase, 2 - 2 * phase
        bent = [x + b * 4 * x * (1 - x) for x, b in zip((up, down), self.bend, strict=True)]
        value = np.where(phase < 0.5, *bent)
        if self.rounding_s:
            n = max(3, int(self.rounding_s * self.sample_hz))
            value = np.convolve(np.pad(value, n, mode="edge"), np.ones(n) / n, "same")[n:-n]
        return self.span_hz * value

    def record(
        self,
        distance: float | Callable[[np.ndarray], np.ndarray],
        *,
        periods: float = 3.0,
        start_s: float = 0.0,
        seed: int = 0,
        name: str = "record00",
        more: tuple[tuple[float, float], ...] = (),
    ) -> FringeRecord:
        """`distance`: m, or a function of time; `more`: reflectors (offset m, amplitude)."""
        rng = np.random.default_rng(seed)
        count = int(round(periods / self.rate_hz * self.sample_hz))
        t = start_s + np.arange(count) / self.sample_hz
        nu = self.frequency(t) + self.origin_hz
        where = distance(t) if callable(distance) else np.full(count, float(distance))
        centre = C / self.wavelength_m

        def fringe(metres: np.ndarray) -> np.ndarray:
            delay = 2 * metres / C
            return np.cos(2 * np.pi * (np.mod(centre * delay, 1.0) + nu * delay))

        seen = fringe(where) + sum(a * fringe(where + d) for d, a in more)
        aux = np.cos(2 * np.pi * nu * self.path_m / C + rng.uniform(0, 6))
        x = np.pi * np.mod(nu / self.spacing_hz + 0.37, 1.0)
        airy = 1 / (1 + (2 * self.finesse / np.pi * np.sin(x)) ** 2)
        noisy = [
            (value + self.noise * rng.standard_normal(count)).astype(np.float32)
            for value in (0.45 + 0.4 * seen, 0.45 + 0.4 * aux, 0.8 * airy)
        ]
        rising = bool(np.mod((start_s - self.first_turn_s) * self.rate_hz, 1.0) < 0.5)
        cavity = noisy[2] if self.cavity else None
        return FringeRecord(noisy[0], noisy[1], cavity, None, start_s, rising, name)

    def records(self, *records: FringeRecord) -> FringeRecords:
        """The set-up's description around them."""
        spacing = self.spacing_hz if self.cavity else None
        return FringeRecords(
            records,
            self.sample_hz,
            self.rate_hz,
            self.path_m,
            spacing,
            wavelength_m=self.wavelength_m,
        )
