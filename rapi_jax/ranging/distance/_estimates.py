"""What an estimator gives of each scan, and how it answers to a target that moves."""

import abc
import dataclasses

import numpy as np

from rapi_jax.ranging.reading._scans import Scans
from rapi_jax.recording._run import ROI

from ._scale import CombReading, Scale

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
    """One value per scan, in the order of `Scans`.

    - `delay_s`: apparent delay of the target, folded to positive. `stderr_s`: from the noise of
      this scan alone. Not numbers where a scan could not be read.
    - `span_hz`: of optical frequency that was used. `motion`: answer to a moving target.
    - `problems`: a line for scans that could not be read well, "" for the others.
    """

    delay_s: np.ndarray
    stderr_s: np.ndarray
    span_hz: np.ndarray
    motion: Motion
    problems: tuple[str, ...]


class AbstractEstimator(abc.ABC):
    """Delays of the target from scans."""

    @property
    @abc.abstractmethod
    def name(self) -> str:
        """As outputs and the command line call it."""

    @property
    @abc.abstractmethod
    def proportional(self) -> bool:
        """Whether delays are in proportion to the interferometer's; else they are the cavity's."""

    @abc.abstractmethod
    def __call__(
        self, scans: Scans, combs: list[CombReading], scale: Scale, centre_hz: float
    ) -> Estimates:
        """Estimate every scan. `centre_hz`: the laser's optical frequency."""


def centre_offset(scans: Scans, low: np.ndarray, high: np.ndarray, scale: Scale) -> np.ndarray:
    """How far the middle between two phases lies above that of the whole branch, Hz.

    The laser's wavelength is that of the middle of its scan. Branches that are crooked in opposite
    ways have their regions of interest elsewhere, by 5 GHz of 75: 1e-5 of the optical frequency,
    and of motion's part in a distance. The branch's ends are continued by parabolas.

    `low`, `high`: the phases, rad, of every scan.
    """
    size = scans.phase.shape[1]
    branch = (size / 2 - scans.first) / (0.5 - ROI[0])
    margin = (branch - size) / 2
    near = max(3, size // 8)
    x = np.arange(0, near, max(1, near // 64))
    first = np.polyfit(x, scans.phase[:, x].T, 2)
    last = np.polyfit(x, scans.phase[:, size - 1 - x].T, 2)
    ends = [c[0] * margin**2 - c[1] * margin + c[2] for c in (first, last)]
    sign = 1.0 if scans.rising else -1.0
    return sign * (low + high - ends[0] - ends[1]) / 2 / (_TWO_PI * scale.delay_s)


def motion_of_line(
    scans: Scans, scale: Scale, centre_hz: float, window: np.ndarray | None
) -> tuple[Motion, np.ndarray, np.ndarray]:
    """Answer to motion of a line through the phase on an even grid of optical frequency.

    Also the spans (Hz), and the time from the middle at each point of the grid (s). The grid is
    that of the estimate itself: a coarser one would do for the answer's size, but the answer is
    multiplied by 6400 times the motion, and 1e-5 of that is 80 um at 50 mm/s.

    `window`: weights over the grid; `None` for even ones.
    """
    place = np.arange(scans.first, scans.last + 1)
    points = place.size
    time = (place - (scans.first + scans.last) / 2) / scans.hz
    low, high = scans.phase[:, scans.first], scans.phase[:, scans.last]
    span = (high - low) / (_TWO_PI * scale.delay_s)
    even = np.linspace(0.0, 1.0, points)
    sign = 1.0 if scans.rising else -1.0
    at = np.stack(
        [
            np.interp(low[k] + even * (high[k] - low[k]), scans.phase[k, place], time)
            for k in range(scans.count)
        ]
    )
    weight = np.ones(points) if window is None else window
    x = even - (weight @ even) / weight.sum()
    weighted = weight * x / (weight @ x**2)  # slope over the whole grid, of a value at each point
    # Of (nu0 + nu) L over nu: the slope of nu0 L over the span, and that of nu L.
    slow, fast = at @ weighted, at**2 @ weighted
    near = sign * (even - 0.5)
    by_span = sign * (centre_hz + centre_offset(scans, low, high, scale)) / span
    velocity = by_span * slow + sign * (at * near) @ weighted
    acceleration = by_span * fast + sign * (at**2 * near) @ weighted
    return Motion(velocity, acceleration / 2), span, at
