"""Physics between generator and laser that acts on whole periods: bandwidth, resonance, etalon.

Linear dynamics act in the frequency domain on one period of a signal that repeats for ever: the
steady state exactly, with no settling to wait for.
"""

import abc
import dataclasses

import numpy as np


class AbstractPhysics(abc.ABC):
    """Changes one period of a signal, given on even times."""

    @property
    @abc.abstractmethod
    def dynamic(self) -> bool:
        """Whether an output depends on more than the input at its own time."""

    @abc.abstractmethod
    def __call__(self, period: np.ndarray, sample_hz: float) -> np.ndarray:
        """The changed period; `sample_hz`: samples a second."""


def _filtered(period: np.ndarray, response: np.ndarray) -> np.ndarray:
    return np.fft.irfft(np.fft.rfft(period) * response, period.size)


def _laplace(period: np.ndarray, sample_hz: float) -> np.ndarray:
    return 2j * np.pi * np.fft.rfftfreq(period.size, 1.0 / sample_hz)


@dataclasses.dataclass(frozen=True)
class Amplifier(AbstractPhysics):
    """Volts of the generator to volts at the piezo: `gain u + offset_v` behind a first-order lag.

    `bandwidth_hz`: -3 dB frequency, Hz; without limit by default.
    """

    gain: float = 1.0
    offset_v: float = 0.0
    bandwidth_hz: float = np.inf

    @property
    def dynamic(self) -> bool:
        """Whether its bandwidth is limited."""
        return bool(np.isfinite(self.bandwidth_hz))

    def __call__(self, period: np.ndarray, sample_hz: float) -> np.ndarray:
        """The piezo's voltage, V."""
        out = self.gain * period + self.offset_v
        if not self.dynamic:
            return out
        s = _laplace(out, sample_hz) / (2 * np.pi * self.bandwidth_hz)
        return _filtered(out, 1.0 / (1.0 + s))


@dataclasses.dataclass(frozen=True)
class MirrorResonance(AbstractPhysics):
    """A second-order resonance of the moving mirror, acting on the displacement (GHz).

    `hertz`: undamped frequency; `damping`: relative to critical.
    """

    hertz: float = 1200.0
    damping: float = 0.12

    @property
    def dynamic(self) -> bool:
        """It is."""
        return True

    def __call__(self, period: np.ndarray, sample_hz: float) -> np.ndarray:
        """The mirror's displacement, in the unit of what drives it."""
        s = _laplace(period, sample_hz) / (2 * np.pi * self.hertz)
        return _filtered(period, 1.0 / (1.0 + 2.0 * self.damping * s + s**2))


@dataclasses.dataclass(frozen=True)
class ParasiticEtalon(AbstractPhysics):
    """A ripple that is fixed in optical frequency: `nu + A sin(2 pi nu / F + phase)`, GHz."""

    amplitude_ghz: float = 0.02
    spacing_ghz: float = 7.0
    phase: float = 0.4

    @property
    def dynamic(self) -> bool:
        """It is not."""
        return False

    def __call__(self, period: np.ndarray, sample_hz: float) -> np.ndarray:
        """The frequency the laser is pulled to, GHz."""
        angle = 2 * np.pi * period / self.spacing_ghz + self.phase
        return period + self.amplitude_ghz * np.sin(angle)
