"""Peaks of the Fabry-Perot cavity in a record: when, how well known, on the raw samples."""

import dataclasses

import numpy as np

from ._decimate import check_finite
from ._threads import side_by_side
from ._thresholds import THRESHOLDS

_FEW = 200_000  # samples looked at for the levels of a record
_CHUNK = 1 << 18  # samples at once


@dataclasses.dataclass(frozen=True, eq=False)
class CavityPeaks:
    """Peaks in the order of time: `time_s` after the record's first sample, standard error (s)."""

    time_s: np.ndarray
    stderr_s: np.ndarray

    def between(self, begin_s: float, end_s: float) -> "CavityPeaks":
        """Those from `begin_s` to `end_s`."""
        low, high = np.searchsorted(self.time_s, [begin_s, end_s])
        return CavityPeaks(self.time_s[low:high], self.stderr_s[low:high])


def find_peaks(
    column: np.ndarray, sample_hz: float, order_s: float, name: str
) -> tuple[CavityPeaks, list[str]]:
    """Every peak that has enough samples, by a Lorentzian through those near its top.

    The inverse of a Lorentzian is a parabola in time, so each peak is a linear least-squares
    problem of three parameters, with weights from the noise of the dark level.

    **Arguments:**

    - `order_s`: usual time from one order to the next, s.
    """
    check_finite(column, "cavity", name)
    few = column[:: max(1, column.size // _FEW)].astype(np.float64)
    dark = float(np.median(few))
    noise = 1.4826 * float(np.median(np.abs(few - dark))) + 1e-12
    high = float(np.quantile(few, 0.9975))
    level = dark + max(THRESHOLDS.peak_level * (high - dark), 6.0 * noise)
    none = CavityPeaks(np.zeros(0), np.zeros(0))
    at = _above(column, level)
    if at.size < THRESHOLDS.fewest_samples or high - dark < 6.0 * noise:
        return none, [f"{name}: the cavity shows no peaks above its noise; not used"]
    breaks = np.flatnonzero(np.diff(at) > max(1.5, THRESHOLDS.join_peaks * order_s * sample_hz))
    first = at[np.concatenate([[0], breaks + 1])]
    last = at[np.concatenate([breaks, [at.size - 1]])]
    width = float(np.median(last - first + 1))
    if width < THRESHOLDS.fewest_samples:
        return none, [
            f"{name}: the cavity's peaks last {width:g} samples, and need "
            f"{THRESHOLDS.fewest_samples}: its channel must not be decimated; not used"
        ]
    faults = []
    bright = column[at]
    top = bright.max()
    if int((bright == top).sum()) > 0.2 * at.size:
        faults.append(f"{name}: the cavity's peaks are clipped; what is left of them is used")
    else:
        top = None
    reach = max(2, round(0.75 * width))
    middle = np.round((first + last) / 2).astype(np.int64)
    middle = middle[(middle >= reach) & (middle < column.size - reach)]
    place, stderr = _fit(column, middle, reach, dark, noise, level, top)
    good = np.isfinite(place) & (np.abs(place) < reach)
    return CavityPeaks((middle + place)[good] / sample_hz, stderr[good] / sample_hz), faults


def _above(column: np.ndarray, level: float) -> np.ndarray:
    """Samples above a level."""
    if column.dtype == np.int16:
        level = int(np.floor(level))

    def work(begin: int) -> np.ndarray:
        return np.flatnonzero(np.ascontiguousarray(column[begin : begin + _CHUNK]) > level) + begin

    return np.concatenate(side_by_side(work, range(0, column.size, _CHUNK)))


def _fit(column, middle, reach, dark, noise, level, top):
    """Offset of each peak from its middle sample, and standard error; samples."""
    k = np.arange(-reach, reach + 1)
    raw = column[middle[:, None] + k[None, :]].astype(np.float64)
    height = raw - dark
    scale = np.maximum(np.max(height, axis=1, keepdims=True), 1e-12)
    y = height / scale
    use = height > 0.5 * (level - dark)
    if top is not None:
        use &= raw < top
    x = k / reach
    basis = np.stack([np.ones_like(x), x, x**2])
    fitted = y
    solution, normal = np.zeros((y.shape[0], 3)), np.zeros((y.shape[0], 3, 3))
    for _ in range(2):  # weights of the second from the curve of the first: no bias by noise
        weight = use * np.clip(fitted, 0.05, 1.5) ** 4
        normal = np.einsum("pk,ik,jk->pij", weight, basis, basis)
        target = np.einsum("pk,ik,pk->pi", weight, basis, 1.0 / np.maximum(y, 1e-3))
        normal[:, range(3), range(3)] += 1e-12
        solution = np.linalg.solve(normal, target[:, :, None])[:, :, 0]
        with np.errstate(divide="ignore"):
            fitted = 1.0 / np.maximum(solution @ basis, 1e-3)
    _, b, c = solution.T
    c = np.where(c > 0, c, np.nan)
    covariance = np.linalg.inv(normal) * ((noise / scale[:, 0]) ** 2)[:, None, None]
    slope = np.stack([np.zeros_like(b), -0.5 / c, 0.5 * b / c**2], axis=1)
    variance = np.einsum("pi,pij,pj->p", slope, covariance, slope)
    return -0.5 * b / c * reach, np.sqrt(variance) * reach
