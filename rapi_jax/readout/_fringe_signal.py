"""The interferometer's fringes as an analytic signal: their phase between turns."""

import dataclasses

import numpy as np
from scipy import fft

from ._refine import smooth_phase
from .turns._detect import fringes_passed


def analytic_phase(y: np.ndarray, highest: float) -> np.ndarray:
    """Phase of the analytic signal, unwrapped: rises wherever the fringe rate is not near 0.

    `highest`: highest fringe rate, cycles a sample; what is faster is noise. Where the analytic
    signal is small (the fringes stand still), noise would spin it: there the phase is taken
    straight across.
    """
    size = int(fft.next_fast_len(y.size) or y.size)
    spectrum = np.asarray(fft.fft(np.pad(y, (0, size - y.size), mode="reflect")))
    hz = np.fft.fftfreq(size)
    spectrum *= np.where(hz > 0, 2.0, 0.0) / (1.0 + (hz / (1.6 * highest)) ** 8)
    z = np.asarray(fft.ifft(spectrum))[: y.size]
    clear = np.flatnonzero(np.abs(z) > 0.4)
    if clear.size < 16:
        clear = np.arange(y.size)
    return _extrapolate_ends(np.interp(np.arange(y.size), clear, np.unwrap(np.angle(z[clear]))))


def _extrapolate_ends(phase: np.ndarray) -> np.ndarray:
    """The record's first and last 0.8 fringe, where the analytic signal fails, by extrapolation."""
    travel = fringes_passed(phase)
    for side in (slice(None), slice(None, None, -1)):
        from_edge = np.abs(travel - travel[side][0])
        outer, inner = from_edge < 0.8, (from_edge >= 0.8) & (from_edge < 4.0)
        if inner.sum() < 16:
            continue
        at = np.arange(phase.size) / phase.size
        origin = float(at[inner].mean())
        line = np.polyfit(at[inner] - origin, phase[inner], 2)
        phase[outer] = np.polyval(line, at[outer] - origin)
    return phase


@dataclasses.dataclass(frozen=True, eq=False)
class FringeSignal:
    """Normalised fringes on the decimated clock, with their analytic phase and its travel."""

    time: np.ndarray
    y: np.ndarray
    good: np.ndarray
    raw: np.ndarray
    phase: np.ndarray
    travel: np.ndarray

    @classmethod
    def of(
        cls, time: np.ndarray, y: np.ndarray, good: np.ndarray, highest: float
    ) -> "FringeSignal":
        """From normalised fringes; `highest` fringe rate in cycles a sample."""
        phase = analytic_phase(np.clip(y, -1.5, 1.5), highest)
        travel = fringes_passed(phase)
        return cls(time, y, good, phase, smooth_phase(time, phase, travel), travel)

    def at(self, time_s: float) -> int:
        """The sample at or after a time."""
        return int(np.clip(np.searchsorted(self.time, time_s), 0, self.time.size - 1))
