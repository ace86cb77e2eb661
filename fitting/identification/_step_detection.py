"""Sudden steps in a residual, told from noise, from corners and from a model that is merely poor.

A hysteresis model is continuous in its drive, so its residual may bend but not jump. A step is what
straight lines through the samples before and after it do not share at the place between them, where
all of it comes from one sample to the next.
"""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

_WIDTHS = (5, 16)  # samples of the lines on either side; the nearest one is left out: no spikes
_NOISE = 6.0  # a step stands so many standard deviations above noise
_USUAL = 8.0  # and above the steps elsewhere, which misfit and correlated noise make
_LOCAL = 0.6  # share of a step that one sample must bring
_BEND = 1.5  # times the change of slope there: a corner is not a step
_MOVE = 0.4  # times what the model itself moves in one sample
_TURN = 2.5  # the same where the drive turns: an unmodelled delay makes steps there
_LEAST = 40  # samples


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
    if error.size < _LEAST:
        return []
    step = np.diff(error)
    noise = 1.4826 * float(np.median(np.abs(np.diff(error, 3)))) / np.sqrt(20.0)
    guard = np.where(_turns(drive), _TURN, _MOVE) * _nearby(np.abs(np.diff(predicted)), 2)
    found: dict[int, float] = {}
    for width in _WIDTHS:
        if error.size < 6 * width:
            continue
        at = np.arange(width, step.size - width - 1)  # between samples `at` and `at + 1`
        value, slope = np.linalg.pinv(np.stack([np.ones(width), np.arange(width) + 1.5], axis=1))
        window = sliding_window_view(error, width)
        after, before = window[at + 2], window[at - width][:, ::-1]
        size = after @ value - before @ value
        rise, fall = after @ slope, -(before @ slope)
        sudden = np.sign(size) * (step[at] - (rise + fall) / 2)
        usual = 1.4826 * float(np.median(np.abs(size)))
        spread = noise * float(np.linalg.norm(value)) * np.sqrt(2.0)
        large = np.maximum(guard[at], max(_NOISE * spread, _USUAL * usual, smallest))
        alone = np.maximum.reduce([guard[at], _BEND * np.abs(rise - fall), _LOCAL * np.abs(size)])
        whole = index[at + 1 + width] - index[at - width] == 2 * width + 1
        hit = whole & (np.abs(size) > large) & (sudden > np.maximum(alone, 5.6 * noise))
        for place, height in zip(at[hit], size[hit], strict=True):
            if abs(height) > abs(found.get(int(place), 0.0)):
                found[int(place)] = float(height)
    return [(int(index[place + 1]), height) for place, height in _strongest(found)]


def _turns(drive: np.ndarray) -> np.ndarray:
    """Whether the drive turns, starts or stops within three samples of each step."""
    way = np.sign(np.diff(drive))
    return _nearby(np.r_[False, way[1:] * way[:-1] <= 0].astype(float), 3) > 0


def _nearby(value: np.ndarray, reach: int) -> np.ndarray:
    """The largest of `value` within `reach` places."""
    return sliding_window_view(np.pad(value, reach, mode="edge"), 2 * reach + 1).max(axis=1)


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
