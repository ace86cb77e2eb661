"""Peaks of the Fabry-Perot cavity, each fitted as a Lorentzian in the interferometer's phase."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.readout._levenberg_marquardt import levenberg_marquardt

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class PeakFit:
    """One peak: time (s), phase of its centre and standard error (rad), half width (rad), height.

    `clipped`: whether samples on the digitizer's edge were left out. `turns`: whether the laser
    turned inside it.
    """

    time_s: float
    phase: float
    stderr: float
    width: float
    height: float
    clipped: bool
    turns: bool


@dataclasses.dataclass(frozen=True, eq=False)
class Regions:
    """Where the cavity transmits: first and last sample of each peak, and the levels that say so.

    `base`: dark level; `threshold`: what counts as light.
    """

    first: np.ndarray
    last: np.ndarray
    base: float
    threshold: float

    @property
    def centre(self) -> np.ndarray:
        """Middle sample of each."""
        return (self.first + self.last) / 2


def find_regions(
    cavity: np.ndarray, sample_hz: float, start_s: float, time: np.ndarray, travel: np.ndarray
) -> Regions | None:
    """Stretches above a quarter of the usual peak, joined within 0.8 fringe; `None` if in noise."""
    few = cavity[:: max(1, cavity.size // 400_000)].astype(np.float64)
    base = float(np.median(few))
    noise = 1.4826 * float(np.median(np.abs(few - base))) + 1e-30
    high = float(np.quantile(few, 0.9975))
    threshold = base + max(0.5 * (high - base), 6.0 * noise)
    at = np.flatnonzero(cavity > threshold)
    if at.size < 4 or high - base < 4.0 * noise:
        return None
    where = np.interp(start_s + at / sample_hz, time, travel)
    breaks = np.flatnonzero(np.diff(where) > 0.8)
    first = at[np.concatenate([[0], breaks + 1])]
    last = at[np.concatenate([breaks, [at.size - 1]])]
    return Regions(first, last, base, threshold)


def turn_bracket(
    centre_s: np.ndarray, travel: np.ndarray, nominal: float, early_s: float, late_s: float
) -> tuple[float, float] | None:
    """The neighbouring peaks between two times that are not one order apart, if one pair is so.

    They are of one order: the laser turned between them.

    `travel`: fringes passed at each peak, as if the laser never turned; `nominal`: fringes between
    orders.
    """
    step = np.diff(travel)
    usual = step[(step > 0.7 * nominal) & (step < 1.4 * nominal)]
    if usual.size < 3:
        return None
    orders = step / float(np.median(usual))
    off = np.where(orders < 0.5, 1.0, np.abs(orders - np.round(orders)))
    # The turn may lie so that its two peaks are nearly a whole order apart: what stands out from
    # the other pairs' scatter counts, however small.
    scatter = 1.4826 * float(np.median(np.abs(usual / np.median(usual) - 1.0)))
    between = (centre_s[1:] > early_s) & (centre_s[:-1] < late_s)
    found = np.flatnonzero(
        (off > np.clip(8.0 * scatter, THRESHOLDS.least_order_error, THRESHOLDS.most_order_error))
        & between
    )
    found = found[np.argsort(-off[found])]
    if not found.size or (found.size > 1 and off[found[1]] > 0.25 * off[found[0]]):
        return None
    return float(centre_s[found[0]]), float(centre_s[found[0] + 1])


def fit_lorentzian(
    phase: Float[np.ndarray, " samples"],
    value: Float[np.ndarray, " samples"],
    start: Float[np.ndarray, " 4"],
) -> tuple[Float[np.ndarray, " 4"], float]:
    """Least squares of `base + height / (1 + ((phase - centre) / width)^2)`.

    `start`: centre, half width, height, base. Returns these four, and the standard error of the
    centre, which allows for residuals of unequal size.
    """

    def model(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = (phase - p[0]) / p[1]
        bell = 1.0 / (1.0 + x**2)
        slope = 2.0 * p[2] * bell**2 * x / p[1]
        return p[3] + p[2] * bell, np.column_stack([slope, slope * x, bell, np.ones_like(x)])

    def project(trial: np.ndarray, before: np.ndarray) -> np.ndarray:
        trial[1] = np.clip(abs(trial[1]), before[1] / 2, before[1] * 2)
        return trial

    fit = levenberg_marquardt(model, value, start, steps=30, tolerance=1e-8, project=project)
    bread = np.linalg.pinv(fit.jacobian.T @ fit.jacobian, rcond=1e-12, hermitian=True)
    scores = fit.jacobian * fit.residual[:, None]
    covariance = bread @ (scores.T @ scores) @ bread
    return fit.parameters, float(np.sqrt(covariance[0, 0]))


def find_peaks(
    cavity: np.ndarray,
    mask: np.ndarray | None,
    sample_hz: float,
    start_s: float,
    time: np.ndarray,
    phase: np.ndarray,
    travel: np.ndarray,
    turns: np.ndarray,
) -> tuple[list[PeakFit], list[str]]:
    """Fit every peak of `cavity`, on its samples as recorded; say what is not one.

    `time`, `phase`, `travel`: the interferometer's reading. `turns`: times of the laser's turns.
    """
    regions = find_regions(cavity, sample_hz, start_s, time, travel)
    if regions is None:
        return [], ["cavity: no peaks above the noise"]
    base, threshold = regions.base, regions.threshold
    clock = start_s + np.arange(cavity.size) / sample_hz
    where = np.interp(clock[np.stack([regions.first, regions.last])], time, travel)
    found: list[PeakFit] = []
    notes: list[str] = []
    edge = (time[0], time[-1])
    for a, b, left, right in zip(regions.first, regions.last, *where, strict=True):
        if b - a < 3:
            notes.append(f"cavity: spike of {b - a + 1} sample(s) at {clock[a]:.6g} s ignored")
            continue
        limits = np.interp(
            [left - THRESHOLDS.peak_half_window, right + THRESHOLDS.peak_half_window], travel, time
        )
        if clock[a] < edge[0] or clock[b] > edge[1]:
            continue
        low = int(np.clip((limits[0] - start_s) * sample_hz, 0, cavity.size - 1))
        high_at = int(np.clip((limits[1] - start_s) * sample_hz + 1, low + 1, cavity.size))
        part = np.arange(low, high_at, max(1, (high_at - low) // 3000))
        edge_here = np.zeros(part.size, dtype=bool) if mask is None else mask[part]
        cut = bool(edge_here.any())
        if cut:
            part = part[~edge_here]
        values = cavity[part].astype(np.float64)
        phases = np.interp(clock[part], time, phase)
        excess = np.maximum(values - threshold, 0.0)
        if part.size < 12 or excess.sum() <= 0:
            notes.append(f"cavity: peak at {clock[a]:.6g} s has too few samples; ignored")
            continue
        centre = float(excess @ phases / excess.sum())
        start = np.array([centre, 0.55, float(values.max() - base), base])
        fit, stderr = fit_lorentzian(phases, values, start)
        turned = bool(((turns > limits[0]) & (turns < limits[1])).any())
        inside = phases.min() <= fit[0] <= phases.max()
        complete = min(abs(fit[0] - phases[0]), abs(fit[0] - phases[-1])) > abs(fit[1])
        if not inside or not (complete or turned):
            if not turned and clock[a] - edge[0] > 1e-4 * (edge[1] - edge[0]):
                notes.append(f"cavity: peak at {clock[a]:.6g} s is cut off; ignored")
            continue
        near = int(np.argmin(np.abs(phases - fit[0])))
        when = float(clock[part[near]])
        if not turned and 2 < near < part.size - 3:
            slope = (phases[near + 2] - phases[near - 2]) / (
                clock[part[near + 2]] - clock[part[near - 2]]
            )
            if slope:
                when += float((fit[0] - phases[near]) / slope)
        found.append(
            PeakFit(when, float(fit[0]), stderr, float(fit[1]), float(fit[2]), cut, turned)
        )
    return _reject_unlike_peaks(found, notes)


def _reject_unlike_peaks(found: list[PeakFit], notes: list[str]) -> tuple[list[PeakFit], list[str]]:
    """Drop peaks unlike the others in width or height."""
    if len(found) < 4:
        return found, notes
    width = float(np.median([p.width for p in found]))
    height = float(np.median([p.height for p in found]))
    kept = []
    for p in found:
        odd = not (0.4 < p.width / width < 2.5) or not (0.4 < p.height / height < 2.5)
        if odd and not p.clipped:
            notes.append(
                f"cavity: spurious peak at {p.time_s:.6g} s (width {p.width / width:.2f}, height "
                f"{p.height / height:.2f} of the usual)"
            )
        else:
            kept.append(p)
    return kept, notes
