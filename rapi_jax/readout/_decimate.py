"""Fringe rates, and the interferometer averaged down to what they need."""

import dataclasses

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.recording._drive import Drive

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Decimated:
    """The interferometer as means over equal groups of samples.

    - `time`: s after the drive's start, centre of each group. `value`: mean, in the record's unit.
    - `good`: whether no sample of the group was clipped.
    - `factor`: samples in a group. `fringe_hz`, `highest_hz`: typical and highest fringe rate.
    """

    time: np.ndarray
    value: np.ndarray
    good: np.ndarray
    factor: int
    fringe_hz: float
    highest_hz: float

    @property
    def step_s(self) -> float:
        """Time between values, s."""
        return float(self.time[-1] - self.time[0]) / (self.time.size - 1)


def fringe_rates(x: np.ndarray, sample_hz: float) -> tuple[float, float]:
    """Typical and highest fringe rate of a record, Hz, from its spectrum above the noise floor."""
    length = min(1 << 15, x.size)
    power = np.zeros(length // 2 + 1)
    window = np.hanning(length).astype(np.float32)
    for begin in range(0, x.size - length + 1, max(1, length)):
        part = x[begin : begin + length].astype(np.float32)
        power += np.abs(np.fft.rfft((part - part.mean()) * window)) ** 2
    power[:2] = 0.0
    floor = float(np.median(power[power.size // 2 :]))
    excess = np.where(power > 6.0 * floor, power, 0.0)
    total = np.cumsum(excess)
    if total[-1] <= 0:
        raise DataError(
            "The interferometer shows no fringes: its spectrum is flat. Is the laser scanning, and "
            "is the right channel recorded?"
        )
    hz = np.arange(power.size) * sample_hz / length
    low, high = np.searchsorted(total, [0.5 * total[-1], 0.995 * total[-1]])
    return float(max(hz[low], hz[1])), float(max(hz[high], hz[1]))


def max_slope_ratio(drive: Drive) -> float:
    """The steepest slope of a drive, short steps left out, over its usual one."""
    slopes = np.abs(np.diff(drive.value))
    moving = slopes[slopes > 1e-3 * slopes.max(initial=0.0)]
    return float(np.quantile(moving, 0.99) / np.median(moving)) if moving.size else 1.0


def decimate(
    x: np.ndarray, sample_hz: float, start_s: float, mask: np.ndarray | None, drive: Drive
) -> Decimated:
    """Average `x` over groups so that the fastest fringe keeps about 16 values.

    A mean over a group loses 0.6 % of the visibility there; noise above the new rate is averaged
    away with it. `mask` marks clipped samples. The codes of a generator make the frequency a
    staircase, whose images in the spectrum lie far above every fringe rate: so the highest rate is
    at most what the steepness of `drive` makes of the usual one.
    """
    typical, highest = fringe_rates(x, sample_hz)
    highest = min(highest, THRESHOLDS.slope_ratio * max_slope_ratio(drive) * typical)
    factor = max(1, int(sample_hz / (THRESHOLDS.samples_per_fringe * highest)))
    groups = x.size // factor
    kept = x[: groups * factor].reshape(groups, factor)
    value = kept.mean(axis=1, dtype=np.float64)
    good = np.ones(groups, dtype=bool)
    if mask is not None:
        good = np.logical_not(np.any(mask[: groups * factor].reshape(groups, factor), axis=1))
    time = start_s + (np.arange(groups) * factor + (factor - 1) / 2) / sample_hz
    return Decimated(time, value, np.asarray(good), factor, typical, highest)
