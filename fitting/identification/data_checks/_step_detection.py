"""Detection of steps in a residual, as distinct from noise, corners and a poor model.

A hysteresis model is continuous in its drive, so its residual may change slope but not jump. A step
is the difference, at the place between two samples, of straight lines through the samples before
and after it (the nearest one left out, so that a spike is no step), if most of it comes from one
sample to the next.
"""

import numpy as np

from rapi_jax.internal import white_noise_rms

from ._thresholds import THRESHOLDS


def detect_steps(
    error: np.ndarray,
    predicted: np.ndarray,
    drive: np.ndarray,
    index: np.ndarray,
    smallest: float,
) -> list[tuple[int, float]]:
    """The sample after each step, and the step's size (signed), of one run's residual.

    `error` is the residual, `predicted` the model, `drive` what was sent, at the samples `index` of
    the run (ascending; no step is seen across a gap); `smallest` is the least step to report.
    """
    if error.size < THRESHOLDS.step_samples:
        return []
    step = np.diff(error)
    noise = white_noise_rms(error)
    guard = np.where(
        _turns(drive), THRESHOLDS.step_motion_at_turn, THRESHOLDS.step_motion
    ) * nearby(np.abs(np.diff(predicted)), 2)
    found: dict[int, float] = {}
    for width in (THRESHOLDS.step_width_short, THRESHOLDS.step_width_long):
        if error.size < 6 * width:
            continue
        at = np.arange(width, step.size - width - 1)  # between samples `at` and `at + 1`
        value, slope = np.linalg.pinv(np.stack([np.ones(width), np.arange(width) + 1.5], axis=1))
        after, before = slice(at[0] + 2, at[-1] + 3), slice(0, at.size)  # of windows
        size = np.correlate(error, value)[after] - np.convolve(error, value, "valid")[before]
        rise = np.correlate(error, slope)[after]
        fall = -np.convolve(error, slope, "valid")[before]
        sudden = np.sign(size) * (step[at] - (rise + fall) / 2)
        usual = 1.4826 * float(np.median(np.abs(size)))
        spread = noise * float(np.linalg.norm(value)) * np.sqrt(2.0)
        least = max(THRESHOLDS.step_noise * spread, THRESHOLDS.step_usual * usual, smallest)
        large = np.maximum(guard[at], least)
        corner = THRESHOLDS.step_corner * np.abs(rise - fall)
        alone = np.maximum.reduce([guard[at], corner, THRESHOLDS.step_sudden * np.abs(size)])
        alone = np.maximum(alone, THRESHOLDS.step_sudden_noise * noise)
        whole = index[at + 1 + width] - index[at - width] == 2 * width + 1
        hit = whole & (np.abs(size) > large) & (sudden > alone)
        for place, height in zip(at[hit], size[hit], strict=True):
            if abs(height) > abs(found.get(int(place), 0.0)):
                found[int(place)] = float(height)
    return [(int(index[place + 1]), height) for place, height in _strongest(found)]


def _turns(drive: np.ndarray) -> np.ndarray:
    """Whether the drive turns, starts or stops within three samples of each step."""
    way = np.sign(np.diff(drive))
    return nearby(np.r_[False, way[1:] * way[:-1] <= 0].astype(float), 3) > 0


def nearby(value: np.ndarray, reach: int) -> np.ndarray:
    """The largest of `value` within `reach` places."""
    padded, size = np.pad(value, reach, mode="edge"), value.size
    return np.maximum.reduce([padded[shift : shift + size] for shift in range(2 * reach + 1)])


def _strongest(found: dict[int, float]) -> list[tuple[int, float]]:
    """Of places within two samples of each other, the one with the largest step."""
    kept: list[tuple[int, float]] = []
    for place in sorted(found):
        if kept and place - kept[-1][0] <= 2:
            if abs(found[place]) > abs(kept[-1][1]):
                kept[-1] = (place, found[place])
        else:
            kept.append((place, found[place]))
    return kept
