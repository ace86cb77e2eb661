"""The scale of optical frequency: the interferometer's delay, from the cavity's comb."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.ranging.reading._scans import Scans
from rapi_jax.ranging.reading._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class CombReading:
    """The cavity's peaks of one scan on its comb.

    - `time_s`: session time; `order`: integers that grow; `phase`: of the interferometer, rad.
    - `inside`: whether in the region of interest; outside, filters bend the phase.
    - `missed`, `extra`: orders without a peak, and peaks off the comb.
    """

    time_s: np.ndarray
    order: np.ndarray
    phase: np.ndarray
    stderr_s: np.ndarray
    inside: np.ndarray
    missed: int
    extra: int


NO_COMB = CombReading(
    np.zeros(0),
    np.zeros(0),
    np.zeros(0),
    np.zeros(0),
    inside=np.zeros(0, dtype=bool),
    missed=0,
    extra=0,
)


@dataclasses.dataclass(frozen=True)
class Scale:
    """The interferometer's delay, s, and standard error; infinite where no cavity told it.

    - `comb_hz`: rms distance of the cavity's peaks from an even comb, Hz. `spacing_hz`: of the
      comb, `None` where there is none.
    """

    delay_s: float
    stderr_s: float
    comb_hz: float
    spacing_hz: float | None = None


def read_comb(scans: Scans, spacing_hz: float, delay_s: float) -> list[CombReading]:
    """Orders of every scan's peaks, counted by the interferometer's phase between them."""
    per_order = _phase_an_order(scans, 2 * np.pi * spacing_hz * delay_s)
    out = []
    for k in range(scans.count):
        peaks = scans.peaks[k]
        place = (peaks.time_s - scans.begin_s[k]) * scans.hz
        phase = np.interp(place, np.arange(scans.phase.shape[1]), scans.phase[k])
        if phase.size < 3:
            out.append(NO_COMB)
            continue
        # A robust origin: the circular mean of all peaks.
        turns = phase / per_order
        origin = np.angle(np.mean(np.exp(2j * np.pi * turns))) / (2 * np.pi)
        order = np.rint(turns - origin)
        off = turns - origin - order
        good = np.abs(off - np.median(off)) < THRESHOLDS.off_comb
        order, first = np.unique(order[good], return_index=True)
        keep = np.flatnonzero(good)[first]
        missed = int(order[-1] - order[0] + 1 - order.size) if order.size else 0
        out.append(
            CombReading(
                peaks.time_s[keep],
                order,
                phase[keep],
                peaks.stderr_s[keep],
                (place[keep] >= scans.first) & (place[keep] <= scans.last),
                missed,
                int(phase.size - keep.size),
            )
        )
    return out


def _phase_an_order(scans: Scans, nominal: float) -> float:
    """The interferometer's phase from one order to the next, rad: as peaks show it.

    A nominal one that is off by a few per cent would lose count over a scan.

    Raises `DataError` where it is off so far that orders cannot be counted at all.
    """
    steps = []
    for k in range(scans.count):
        place = (scans.peaks[k].time_s - scans.begin_s[k]) * scans.hz
        steps.append(np.diff(np.interp(place, np.arange(scans.phase.shape[1]), scans.phase[k])))
    step = np.concatenate(steps)
    if step.size < THRESHOLDS.fewest_steps:
        return nominal
    seen = float(np.median(step))
    regular = float(np.mean(np.abs(step / seen - 1.0) < THRESHOLDS.off_comb)) if seen > 0 else 0.0
    if regular < 0.5:  # peaks are not even: nothing to tell the nominal one by
        return nominal
    ratio = seen / nominal
    if abs(ratio - 1.0) > THRESHOLDS.path_far:
        raise DataError(
            f"The cavity's peaks are {seen / (2 * np.pi):.4g} fringes of the interferometer apart, "
            f"but `interferometer_path_m` and `cavity_spacing_hz` say {nominal / (2 * np.pi):.4g}. "
            "One of them is wrong, or in another unit than m and Hz, or the channels are exchanged."
        )
    return nominal if abs(ratio - 1.0) < THRESHOLDS.path_near else seen


@dataclasses.dataclass
class ScaleSums:
    """Sums over scans from which the scale follows; grows as records arrive.

    The standard error is the larger of two: from the peaks' scatter about the comb, as if each
    were off by itself, and from the scatter of the scans' own slopes: a comb may move in a scan.
    """

    xx: float = 0.0
    xy: float = 0.0
    yy: float = 0.0
    count: int = 0
    scans: int = 0
    xx_xx: float = 0.0
    xx_xy: float = 0.0
    xy_xy: float = 0.0

    def add(self, combs: Sequence[CombReading]) -> None:
        """Take further scans in."""
        for comb in combs:
            if comb.inside.sum() < 3:
                continue
            x = comb.order[comb.inside]
            y = comb.phase[comb.inside]
            x, y = x - x.mean(), y - y.mean()
            xx, xy = float(x @ x), float(x @ y)
            self.xx += xx
            self.xy += xy
            self.xx_xx += xx**2
            self.xx_xy += xx * xy
            self.xy_xy += xy**2
            self.yy += float(y @ y)
            self.count += x.size
            self.scans += 1

    def scale(self, nominal_s: float, spacing_hz: float | None) -> Scale:
        """The delay from all scans so far; the nominal one where no comb was read."""
        if spacing_hz is None or self.count - self.scans < 2:
            return Scale(nominal_s, float("inf"), float("nan"), spacing_hz)
        period = self.xy / self.xx
        rest = max(self.yy - period * self.xy, 0.0)
        variance = rest / (self.count - self.scans - 1)
        per = 2 * np.pi * spacing_hz
        rms_hz = np.sqrt(variance) / period * spacing_hz
        error = np.sqrt(variance / self.xx)
        if self.scans >= THRESHOLDS.fewest_slopes:
            apart = self.xy_xy - 2 * period * self.xx_xy + period**2 * self.xx_xx
            between = max(apart, 0.0) * self.scans / (self.scans - 1)
            error = max(error, np.sqrt(between) / self.xx)
        return Scale(period / per, float(error / per), float(rms_hz), spacing_hz)
