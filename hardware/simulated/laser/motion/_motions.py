"""Steady motion, vibrations and drift of a target."""

import dataclasses
from functools import cached_property

import numpy as np

from ._base import AbstractMotion

_BLOCK = 1 << 16  # sines at once
_NODE_S = 30.0  # nodes of the drift's walk: a temperature has no jumps


@dataclasses.dataclass(frozen=True)
class ConstantVelocity(AbstractMotion):
    """`velocity_m_per_s` from session time `start_s` to `stop_s`; at rest before and after."""

    velocity_m_per_s: float
    start_s: float = 0.0
    stop_s: float = np.inf

    @property
    def highest_hz(self) -> float:
        """None."""
        return 0.0

    def at(self, session_s: np.ndarray) -> np.ndarray:
        """Displacement, m."""
        return self.velocity_m_per_s * (
            np.clip(session_s, self.start_s, self.stop_s) - self.start_s
        )

    def has_kink(self, start_s: float, stop_s: float) -> bool:
        """Where it starts and stops."""
        return any(start_s <= at <= stop_s for at in (self.start_s, self.stop_s))


@dataclasses.dataclass(frozen=True)
class Vibration(AbstractMotion):
    """`amplitude_m sin(2 pi hz t + phase)`."""

    amplitude_m: float
    hz: float
    phase: float = 0.0

    @property
    def highest_hz(self) -> float:
        """Its own."""
        return self.hz

    def at(self, session_s: np.ndarray) -> np.ndarray:
        """Displacement, m."""
        return self.amplitude_m * np.sin(2.0 * np.pi * self.hz * session_s + self.phase)

    def has_kink(self, start_s: float, stop_s: float) -> bool:
        """Nowhere."""
        return False


@dataclasses.dataclass(frozen=True)
class RandomVibration(AbstractMotion):
    """Gaussian noise of `rms_m` with an even spectrum from `low_hz` to `high_hz`.

    A sum of `lines` sinusoids with random amplitudes, one in each of as many equal bands, at a
    random place in it. `rms_m` holds over seeds; one seed differs by about `1 / (2 sqrt(lines))` of
    it (3 %). Records longer than `lines / (high_hz - low_hz)` resolve the lines.
    """

    rms_m: float
    low_hz: float
    high_hz: float
    seed: int = 0
    lines: int = 256

    def __post_init__(self) -> None:
        if not (0 <= self.low_hz < self.high_hz and self.lines >= 1):
            raise ValueError(f"A band goes from a lower to a higher frequency, unlike {self}.")

    @property
    def highest_hz(self) -> float:
        """Upper end of the band."""
        return self.high_hz

    @cached_property
    def _lines(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Angular frequencies (rad/s), amplitudes (m) and phases (rad)."""
        rng = np.random.default_rng(self.seed)
        place = (np.arange(self.lines) + rng.uniform(size=self.lines)) / self.lines
        omega = 2.0 * np.pi * (self.low_hz + (self.high_hz - self.low_hz) * place)
        cosine, sine = self.rms_m / np.sqrt(self.lines) * rng.standard_normal((2, self.lines))
        return omega, np.hypot(cosine, sine), np.arctan2(cosine, sine)

    def at(self, session_s: np.ndarray) -> np.ndarray:
        """Displacement, m."""
        omega, amplitude, phase = self._lines
        times = np.array_split(session_s, 1 + session_s.size * self.lines // _BLOCK)
        return np.concatenate([np.sin(time[:, None] * omega + phase) @ amplitude for time in times])

    def has_kink(self, start_s: float, stop_s: float) -> bool:
        """Nowhere."""
        return False


@dataclasses.dataclass(frozen=True)
class ThermalDrift(AbstractMotion):
    """A random walk from session time 0 on; `rms_m`: after one hour, m. Straight over 30 s."""

    rms_m: float
    seed: int = 0

    @property
    def highest_hz(self) -> float:
        """None between its nodes."""
        return 0.0

    def at(self, session_s: np.ndarray) -> np.ndarray:
        """Displacement, m."""
        place = np.maximum(session_s, 0.0) / _NODE_S
        count = int(np.max(place, initial=0.0)) + 1
        # A longer walk begins like a shorter one of the same seed.
        steps = np.random.default_rng(self.seed).standard_normal(count)
        walk = np.concatenate([[0.0], np.cumsum(steps)])
        scale = self.rms_m * np.sqrt(_NODE_S / 3600.0)
        return scale * np.interp(place, np.arange(walk.size), walk)

    def has_kink(self, start_s: float, stop_s: float) -> bool:
        """At its nodes."""
        return stop_s >= 0 and start_s // _NODE_S != stop_s // _NODE_S
