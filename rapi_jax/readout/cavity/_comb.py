"""The cavity's comb as a ruler: orders, calibration of the delay, wrong fringes."""

import dataclasses

import numpy as np

from ._peaks import PeakFit


@dataclasses.dataclass(frozen=True, eq=False)
class Comb:
    """Peaks on the comb: `order` of each, `residual` and `slip` in fringes of the interferometer.

    `period`: phase between neighbouring orders, rad, with `stderr`. `origin`: phase of order 0.
    `slip`: whole fringes by which the phase at each peak is off, 0 for most. `used`: peaks that
    lie on the comb.
    """

    order: np.ndarray
    residual: np.ndarray
    slip: np.ndarray
    used: np.ndarray
    origin: float
    period: float
    stderr: float


def _first_period(phase: np.ndarray, nominal: float) -> float:
    """Phase between neighbouring orders from neighbouring peaks; robust to missed ones."""
    steps = np.abs(np.diff(phase))
    steps = steps[(steps > 0.7 * nominal) & (steps < 1.4 * nominal)]
    return float(np.median(steps)) if steps.size else nominal


def _orders(phase: np.ndarray, period: float) -> tuple[np.ndarray, float, float]:
    """Orders by growing outward from the middle: the line is refitted as it gets longer."""
    begin = phase[phase.size // 2]
    for fraction in (0.15, 0.4, 1.0, 1.0):
        far = max(fraction * float(np.abs(phase - begin).max()), 2.2 * period)
        near = np.abs(phase - begin) <= far
        best = _grid_origin(phase[near], period)
        order = np.round((phase - best) / period)
        line, _ = _robust_line(order[near], phase[near], period)
        period, origin = line
        begin_order = np.round((begin - origin) / period)
        begin = origin + begin_order * period
    order = np.round((phase - origin) / period)
    return order.astype(int), origin, period


def _grid_origin(phase: np.ndarray, period: float) -> float:
    """Origin at which most peaks lie near a multiple of `period`."""
    angle = 2 * np.pi * phase / period
    return (
        float(np.angle(np.median(np.cos(angle)) + 1j * np.median(np.sin(angle))))
        / (2 * np.pi)
        * period
    )


def _robust_line(order, phase, period):
    """Line of phase against order, reweighted; slope falls back on `period`."""
    weight = np.ones(order.size)
    intercept, slope = float(np.median(phase - period * order)), period
    if np.unique(order).size < 2:
        return (slope, intercept), weight
    for _ in range(12):
        residual = phase - intercept - slope * order
        residual = residual - 2 * np.pi * np.round(residual / (2 * np.pi))
        target = intercept + slope * order + residual
        scale = max(1.4826 * float(np.median(np.abs(residual))), 0.01)
        weight = 1.0 / (1.0 + (residual / (3 * scale)) ** 2)
        w = weight.sum()
        mean = (weight @ order) / w
        centred = order - mean
        below = float(weight @ centred**2)
        if below <= 0:
            break
        slope = float((weight * centred) @ target / below)
        intercept = float((weight @ target) / w - slope * mean)
    return (slope, intercept), weight


def read_comb(peaks: list[PeakFit], nominal: float) -> Comb | None:
    """Orders, slips and period of the comb; `None` with fewer than three peaks.

    A whole fringe too many or too few between two peaks moves all later ones by 2 pi: that is a
    slip. A peak anywhere else is not of the comb.
    """
    if len(peaks) < 3:
        return None
    phase = np.array([p.phase for p in peaks])
    stderr = np.array([p.stderr for p in peaks])
    order, origin, period = _orders(phase, _first_period(phase, nominal))
    raw = (phase - origin - period * order) / (2 * np.pi)
    slip = np.round(raw).astype(int)
    residual = raw - slip
    usual = 1.4826 * float(np.median(np.abs(residual)))
    used = np.abs(residual) < max(6 * usual, 0.06)
    # A slip lasts; one peak off by itself is not of the comb.
    for i in range(slip.size):
        others = [j for j in (i - 1, i + 1) if 0 <= j < slip.size]
        if len(others) == 2 and slip[others[0]] == slip[others[1]] != slip[i]:
            used[i] = False
    if used.sum() >= 3 and np.unique(order[used]).size >= 2:
        steady = _most_frequent(slip[used])
        target = phase - 2 * np.pi * slip
        w = used / np.maximum(stderr, 0.3 * np.median(stderr)) ** 2
        mean = (w @ order) / w.sum()
        centred = order - mean
        period = float((w * centred) @ target / (w @ centred**2))
        origin = float((w @ target) / w.sum() - period * mean)
        rest = target - origin - period * order
        count = max(int(used.sum()) - 2, 1)
        chi2 = float(w @ rest**2) / count
        period_stderr = float(np.sqrt(max(chi2, 1.0) / (w @ centred**2)))
        origin += 2 * np.pi * steady
        slip = slip - steady
        residual = rest / (2 * np.pi)
    else:
        period_stderr = float("inf")
    return Comb(order, residual, slip, used, origin, period, period_stderr)


def _most_frequent(values: np.ndarray) -> int:
    numbers, counts = np.unique(values, return_counts=True)
    return int(numbers[np.argmax(counts)])
