"""What an estimator gives of each scan, and how it answers to a target that moves."""

import abc
import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.ranging.reading._scans import Scans

from ._scale import CombReading, Scale
from ._thresholds import THRESHOLDS

C = 299_792_458.0  # m/s
_TWO_PI = 2 * np.pi


@dataclasses.dataclass(frozen=True, eq=False)
class Motion:
    """How far a scan's distance moves with the target's motion about the scan's middle.

    An estimate is a weighted mean of the distance over the scan, with weights that add up to 1 but
    are of either sign and as large as the optical frequency over the span (Eq. 2).

    - `velocity_s`: m per m/s. `acceleration_s2`: m per m/s^2.
    """

    velocity_s: np.ndarray
    acceleration_s2: np.ndarray


@dataclasses.dataclass(frozen=True, eq=False)
class Estimates:
    """One value a scan, in the order of `Scans`.

    - `delay_s`: apparent delay of the target, folded to positive. `stderr_s`: from the noise of
      this scan alone. Not numbers where a scan could not be read.
    - `span_hz`: of optical frequency that was used. `motion`: answer to a moving target.
    - `proportional`: whether delays are in proportion to the interferometer's (resampling), or
      stand on the cavity alone (counting).
    - `problems`: a line for scans that could not be read well, "" for the others.
    """

    delay_s: np.ndarray
    stderr_s: np.ndarray
    span_hz: np.ndarray
    motion: Motion
    proportional: bool
    problems: tuple[str, ...]


class AbstractEstimator(abc.ABC):
    """Delays of the target from scans."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As outputs and the command line call it."""

    @abc.abstractmethod
    def __call__(
        self, scans: Scans, combs: list[CombReading], scale: Scale, centre_hz: float
    ) -> Estimates:
        """Estimate every scan. `centre_hz`: the laser's optical frequency."""


def line_weights(
    nu: Float[np.ndarray, "scans points"],
    window: Float[np.ndarray, " points"],
    centre_hz: float,
) -> Float[np.ndarray, "scans points"]:
    """Weights of the distance at each point for the slope of a line through the phase.

    `nu`: optical frequency from the scan's centre, Hz. The phase is `2 pi (nu0 + nu) 2 L / c`
    (Eq. 1), and its slope over `nu` by least squares with weights `window` is linear in it.
    """
    mean = (nu @ window) / window.sum()
    x = nu - mean[:, None]
    top = window * x * (centre_hz + nu)
    return top / np.sum(window * x * nu, axis=1, keepdims=True)


def motion_of_line(
    scans: Scans, scale: Scale, centre_hz: float, window: np.ndarray | None
) -> tuple[Motion, np.ndarray]:
    """Answer to motion of a line through the phase on an even grid of optical frequency; spans, Hz.

    `window`: weights over the grid, on any number of points; `None` for even ones.
    """
    points = THRESHOLDS.gain_points
    place = np.arange(scans.first, scans.last + 1, dtype=float)
    time = (place - (scans.first + scans.last) / 2) / scans.hz
    low, high = scans.phase[:, scans.first], scans.phase[:, scans.last]
    span = (high - low) / (_TWO_PI * scale.delay_s)
    even = np.linspace(0.0, 1.0, points)
    sign = 1.0 if scans.rising else -1.0
    at = np.stack(
        [
            np.interp(low[k] + even * (high[k] - low[k]), scans.phase[k, place.astype(int)], time)
            for k in range(scans.count)
        ]
    )
    nu = sign * span[:, None] * (even - 0.5)[None, :]
    weight = np.ones(points) if window is None else np.interp(even, _even(window), window)
    weight = weight * _trapezoid(points)
    g = line_weights(nu, weight, centre_hz)
    return Motion(np.sum(g * at, axis=1), np.sum(g * at**2, axis=1) / 2), span


def _even(window: np.ndarray) -> np.ndarray:
    return np.linspace(0.0, 1.0, window.size)


def _trapezoid(points: int) -> np.ndarray:
    w = np.ones(points)
    w[0] = w[-1] = 0.5
    return w
