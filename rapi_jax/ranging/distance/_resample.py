"""The measurement arm on an even grid of optical frequency: the interferometer as its clock."""

import dataclasses

import numpy as np
from jaxtyping import Float32

from rapi_jax.ranging.reading._analytic import taper
from rapi_jax.ranging.reading._scans import Scans
from rapi_jax.ranging.reading._transforms import usable_size

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Resampled:
    """Samples on even steps of the interferometer's phase, and where the region of interest is.

    - `value`: with cosine edges outside the region. `step`: of each scan, rad of the
      interferometer's phase. `first`, `last`: the region, in samples.
    """

    value: Float32[np.ndarray, "scans points"]
    step: np.ndarray
    first: int
    last: int

    @property
    def points(self) -> int:
        """In the region of interest."""
        return self.last - self.first + 1


def resample(scans: Scans) -> Resampled:
    """Every scan on a grid of its own, with as many points in the region of interest as samples."""
    inside = scans.last - scans.first + 1
    low, high = scans.phase[:, scans.first], scans.phase[:, scans.last]
    step = (high - low) / (inside - 1)
    left = int(np.min((low - scans.phase[:, 0]) / step))
    right = int(np.min((scans.phase[:, -1] - high) / step))
    size = usable_size(inside + left + right)
    spare = inside + left + right - size
    left, right = left - spare // 2, right - (spare - spare // 2)
    if min(left, right) < 1:  # no room: the region itself, cut to a fast size
        left = right = 0
        size = usable_size(inside)
    grid = np.arange(-left, size - left)
    value = np.empty((scans.count, size), dtype=np.float32)
    for k in range(scans.count):
        value[k] = np.interp(low[k] + grid * step[k], scans.phase[k], scans.signal[k])
    last = min(left + inside - 1, size - 1)
    value -= value[:, left : last + 1].mean(axis=1, keepdims=True)
    edge = min(left, right)
    if edge > 1:
        value *= taper(size, edge)[None, :]
    return Resampled(value, step, left, last)


@dataclasses.dataclass(frozen=True, eq=False)
class Beat:
    """Where the power of each scan's spectrum lies, in its bins, and how sure there is a beat.

    - `peak`: bin of the largest power. `low`, `high`: edges of the band that holds it.
    - `ratio`: largest power over the mean of the noise.
    """

    peak: np.ndarray
    low: np.ndarray
    high: np.ndarray
    ratio: np.ndarray


def find_beat(spectrum: np.ndarray) -> Beat:
    """The strongest beat of each spectrum and the band around it that holds its power."""
    power = np.abs(spectrum) ** 2
    fewest = int(THRESHOLDS.fewest_fringes)
    power[:, :fewest] = 0.0
    noise = np.median(power[:, power.shape[1] // 2 :], axis=1) / np.log(2.0) + 1e-30
    peak = np.argmax(power, axis=1)
    ratio = power[np.arange(peak.size), peak] / noise
    excess = np.where(power > THRESHOLDS.detection * noise[:, None], power, 0.0)
    total = np.cumsum(excess, axis=1)
    total /= total[:, -1:] + 1e-30
    tail = THRESHOLDS.tail
    low = np.array([np.searchsorted(row, tail) for row in total])
    high = np.array([np.searchsorted(row, 1 - tail) for row in total])
    low = np.minimum(low, peak) / THRESHOLDS.beyond
    high = np.maximum(high, peak) * THRESHOLDS.beyond
    return Beat(peak, low, high, ratio)
