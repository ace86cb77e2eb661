"""A phase model everywhere, improved by the fringes themselves."""

import numpy as np
from scipy import interpolate

from ._thresholds import THRESHOLDS


def _windows(low: np.ndarray, high: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """All samples of windows `low..high`, one after another: sample, window, first of each."""
    size = high - low
    first = np.concatenate([[0], np.cumsum(size)[:-1]])
    window = np.repeat(np.arange(size.size), size)
    return np.arange(size.sum()) - np.repeat(first - low, size), window, first


def fringe_path(phase: np.ndarray) -> np.ndarray:
    """Fringes passed since the first value, counting back and forth alike, strictly growing."""
    steps = np.abs(np.diff(phase)) / (2 * np.pi)
    return np.concatenate([[0.0], np.cumsum(steps + 1e-9)])


def smooth_phase(
    time: np.ndarray, phase: np.ndarray, travel: np.ndarray, *, half: float = 2.0
) -> np.ndarray:
    """`phase` by local parabolas in time over `half` fringes to both sides: less of its noise.

    Its noise would else pass for the laser's, and hide in the fringes' residuals.
    """
    travel = travel + 1e-9 * np.arange(travel.size)
    nodes = np.arange(0.0, travel[-1] + 0.5, 0.5)
    nodes[-1] = travel[-1]
    low = np.searchsorted(travel, nodes - half)
    high = np.searchsorted(travel, nodes + half, side="right")
    sample, window, first = _windows(low, high)
    at = np.interp(nodes, travel, time)
    reach = np.maximum(time[high - 1] - time[low], 1e-30)
    s = (time[sample] - at[window]) / reach[window]
    v = phase[sample] - phase[low][window]
    w = (1 - np.minimum(np.abs(travel[sample] - nodes[window]) / (half * 1.001), 1) ** 3) ** 3
    moment = [np.add.reduceat(w * s**k, first) for k in range(5)]
    target = [np.add.reduceat(w * v * s**k, first) for k in range(3)]
    normal = np.array([[moment[i + j] for j in range(3)] for i in range(3)]).transpose(2, 0, 1)
    normal = normal + 1e-9 * np.eye(3) * normal[:, :1, :1]
    value = np.linalg.solve(normal, np.array(target).T[:, :, None])[:, 0, 0] + phase[low]
    at, keep = np.unique(at, return_index=True)
    return np.asarray(interpolate.PchipInterpolator(at, value[keep])(time))


def estimate_noise(error: np.ndarray, sine2: np.ndarray, good: np.ndarray) -> tuple[float, float]:
    """Variance of the fringes (in amplitudes) and of the phase (rad^2), from residuals."""
    e2, s2 = error[good] ** 2, sine2[good]
    cap = 25.0 * np.median(e2) / 0.455
    e2 = np.minimum(e2, cap)
    centred = s2 - s2.mean()
    slope = float(centred @ e2 / max(centred @ centred, 1e-300))
    level = float(e2.mean() - slope * s2.mean())
    if slope < 0:
        return float(e2.mean()), 0.0
    if level < 0:
        return 1e-3 * float(e2.mean()), float(e2.mean() / s2.mean())
    return level, slope


def refine_phase(
    time: np.ndarray,
    y: np.ndarray,
    good: np.ndarray,
    phase: np.ndarray,
    base: np.ndarray,
    *,
    half: float = 0.75,
) -> tuple[np.ndarray, np.ndarray]:
    """One weighted Gauss-Newton step of `y = cos(phase)` in sliding windows.

    In each window of `half` fringes to both sides the correction to the smooth `base` is a straight
    line in time, weighted by sin^2 of the phase and a tricube; corrections made before are part of
    it, so that repeating the step does not fit ever finer noise. Returns the corrected phase and
    its standard error, rad.
    """
    travel = fringe_path(phase)
    nodes = np.arange(
        0.0, travel[-1] + 1.0 / THRESHOLDS.nodes_per_fringe, 1.0 / THRESHOLDS.nodes_per_fringe
    )
    nodes[-1] = travel[-1]
    low = np.searchsorted(travel, nodes - half)
    high = np.searchsorted(travel, nodes + half, side="right")
    sample, window, first = _windows(low, high)
    sine = np.sin(phase)
    error = y - np.cos(phase)
    level, slope = estimate_noise(error, sine**2, good)
    usual = level + slope * sine**2
    robust = np.minimum(1.0, 3.5 * np.sqrt(usual) / np.maximum(np.abs(error), 1e-30))
    weight = good * robust

    at = np.interp(nodes, travel, time)
    reach = np.maximum(time[high - 1] - time[low], 1e-30)
    s = (time[sample] - at[window]) / reach[window]
    kernel = (1 - np.minimum(np.abs(travel[sample] - nodes[window]) / (half * 1.001), 1) ** 3) ** 3
    k = kernel * weight[sample] / usual[sample]
    information = k * sine[sample] ** 2
    score = information * (phase - base)[sample] - k * sine[sample] * error[sample]
    spread = k * information * usual[sample]

    def total(values: np.ndarray) -> np.ndarray:
        return np.add.reduceat(values, first)

    m0, m1, m2 = total(information), total(information * s), total(information * s**2)
    v0, v1 = total(score), total(score * s)
    # A ridge keeps windows without information (a turn on a fringe's top) where the model is.
    ridge = 1e-3 * (np.median(m0) + 1e-30)
    m0r, m2r = m0 + ridge, m2 + ridge / 3
    det = m0r * m2r - m1**2
    shift = (m2r * v0 - m1 * v1) / det
    c0, c1, c2 = total(spread), total(spread * s), total(spread * s**2)
    variance = (m2r**2 * c0 - 2 * m2r * m1 * c1 + m1**2 * c2) / det**2
    variance = variance + (ridge * m2r / det) ** 2 * 0.3**2  # where the model alone decides
    # Errors of visibility and background do not average out over part of a fringe.
    lean = k * sine[sample]
    for wrong in (lean * np.cos(phase[sample]), lean):
        variance = variance + (THRESHOLDS.envelope_error * total(wrong) / m0r) ** 2
    shift = np.clip(shift, -0.6, 0.6)
    return (
        base + np.interp(travel, nodes, shift),
        np.interp(travel, nodes, np.sqrt(variance)),
    )
