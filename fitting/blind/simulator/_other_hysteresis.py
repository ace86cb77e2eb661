r"""Actuators whose hysteresis is none of the model's: classical families of the literature.

All are independent of the rate, with memory fixed in volts, where the paper's thresholds grow with
rate and swing (Eq. 11).

- Classical Prandtl-Ishlinskii: symmetric plays with thresholds in volts (Kuhnen, European Journal
  of Control 9, 2003).
- Preisach with a smooth density: a density that is a product of one in half-width and one in bias
  is a sum of plays, each bent by the integral of its density in bias (Brokate and Sprekels,
  Hysteresis and Phase Transitions, 1996, section 2.4).
- Maxwell slip: springs and sliders in parallel, driven by the voltage that they carry together
  (Goldfarb and Celanovic, IEEE Control Systems 17, 1997); so the displacement is the inverse of a
  classical operator, which is one again (Kuhnen).
- Bouc-Wen: $h' = a u' - b |u'| |h|^{n-1} h - c u' |h|^n$ (Wen, 1976), less from a straight line.
"""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt
import scipy.interpolate

from ._plays import play_memory, stretch_index, turning_points
from ._scan import Scan

Array = npt.NDArray[np.float64]
STEPS = 200  # of Runge and Kutta's method along each stretch
ABSORBED = 12  # plays of a flexible model, by which an effect's size is reckoned


@runtime_checkable
class Actuator(Protocol):
    """What turns a drive in V into an optical frequency in GHz."""

    def respond(self, u: Array, rate: float, swing: float) -> tuple[Array, Array]:
        """Frequency of one run, and its hysteretic part, both in GHz."""
        ...


@dataclass(frozen=True, eq=False)
class FixedPlays:
    """Symmetric plays, each bent or straight, and a polynomial; all arrays one entry per play."""

    threshold: Array  # V
    weight: Array  # GHz/V
    line: Array  # GHz/V^k
    centre: Array | None = None  # V, of each density in bias; none: straight plays
    width: Array | None = None  # V

    def respond(self, u: Array, rate: float, swing: float) -> tuple[Array, Array]:
        """See `Actuator`; rate and swing do not matter."""
        held = self._bent(symmetric_plays(u, self.threshold))
        hysteretic = (held - self._bent(u[:, None])) @ self.weight
        total = held @ self.weight + np.polynomial.polynomial.polyval(u, self.line)
        return total, hysteretic

    def _bent(self, value: Array) -> Array:
        if self.centre is None or self.width is None:
            return value
        return self.width * np.tanh((value - self.centre) / self.width)


@dataclass(frozen=True, eq=False)
class BoucWen:
    """A straight line in the drive less a hysteretic variable."""

    rise: float  # a
    fall: float  # b, 1/V
    skew: float  # c, 1/V
    power: float  # n
    scale: float  # GHz/V
    line: Array

    def respond(self, u: Array, rate: float, swing: float) -> tuple[Array, Array]:
        """See `Actuator`; rate and swing do not matter."""
        ends, value = turning_points(u), 0.0
        h = np.zeros_like(u)
        for a, b in zip(ends[:-1], ends[1:], strict=True):
            path = np.linspace(u[a], u[b], STEPS + 1)
            along = self._along(path, value)
            slope = np.array([self._slope(x, float(u[b] - u[a])) for x in along])
            rows = slice(a, b + 1)
            if u[b] == u[a]:
                h[rows] = value
                continue
            order = 1 if u[b] > u[a] else -1
            spline = scipy.interpolate.CubicHermiteSpline(
                path[::order], along[::order], slope[::order]
            )
            h[rows] = spline(u[rows])
            value = float(along[-1])
        total = np.polynomial.polynomial.polyval(u, self.line) - self.scale * h
        return total, -self.scale * h

    def _along(self, path: Array, value: float) -> Array:
        step, out = float(path[1] - path[0]), [value]
        for _ in range(len(path) - 1):
            one = self._slope(value, step)
            two = self._slope(value + step / 2 * one, step)
            three = self._slope(value + step / 2 * two, step)
            four = self._slope(value + step * three, step)
            value += step / 6 * (one + 2 * two + 2 * three + four)
            out.append(value)
        return np.array(out)

    def _slope(self, h: float, direction: float) -> float:
        size = abs(h) ** self.power
        return self.rise - (self.fall * np.sign(direction) * np.sign(h) + self.skew) * size


def symmetric_plays(u: Array, threshold: Array) -> Array:
    """Each play's output in V, shape (samples, plays)."""
    ends = turning_points(u)
    held = play_memory(u, ends, (threshold,), (np.ones_like(threshold), threshold), 0.0)
    high = np.minimum(u[:, None] + threshold, held[stretch_index(ends, len(u))])
    return np.maximum(u[:, None] - threshold, high)


def absorbed_columns(scan: Scan, oversample: int) -> Array:
    """What a flexible hysteresis absorbs of one settled period, shape (samples, columns)."""
    fine = scan.samples * oversample
    u = scan.voltage((np.arange(2 * fine + 1) - fine) * scan.step_s / oversample)
    rows = fine + oversample * np.arange(scan.samples)
    threshold = np.ptp(u) / 2 * np.arange(1, ABSORBED + 1) / (ABSORBED + 1)
    return np.concatenate(
        [u[rows, None] ** np.arange(5), symmetric_plays(u, threshold)[rows]], axis=1
    )


def inverse_plays(straight: float, threshold: Array, weight: Array) -> tuple[float, Array, Array]:
    """The inverse of `straight u + sum of weight times play`: straight part, thresholds, weights.

    Thresholds grow; every sum of the first weights and `straight` is positive (Kuhnen 2003).
    """
    partial = straight + np.concatenate(([0.0], np.cumsum(weight)))
    apart = np.diff(threshold, prepend=0.0)
    return 1 / straight, np.cumsum(partial[:-1] * apart), np.diff(1 / partial)
