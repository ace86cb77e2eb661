"""A dense reading on the samples of a drive."""

import numpy as np

from rapi_jax.recording._drive import Drive


def resample_drive(drive: Drive, samples: int) -> Drive:
    """`drive` on `samples` even samples over the same duration (of whole steps)."""
    if samples < 8:
        raise ValueError(f"Argument `samples` must be at least 8, but is {samples}.")
    duration = drive.size * drive.step_s
    time = np.arange(samples) * (duration / samples)
    whole = drive.repeats and abs(duration * drive.rate - round(duration * drive.rate)) < 1e-3
    period = duration if whole else None
    value = np.interp(time, drive.time, drive.value, period=period)
    return Drive(time, value, drive.excitation_hz, drive.waveform, drive.start_s)


def sample_reading(
    time: np.ndarray,
    value: np.ndarray,
    stderr: np.ndarray,
    cuts: np.ndarray,
    drive: Drive,
) -> np.ndarray:
    """`value` at the drive's samples by local straight lines that never cross `cuts` (s)."""
    step = float(time[-1] - time[0]) / (time.size - 1)
    at = drive.time.copy()
    if drive.repeats:
        period = 1.0 / drive.rate
        early, late = at < time[0] - step / 2, at > time[-1] + step / 2
        at[early] += period * np.ceil((time[0] - at[early]) / period)
        at[late] -= period * np.ceil((at[late] - time[-1]) / period)
    outside = (at < time[0] - step) | (at > time[-1] + step)
    half = drive.step_s / 2
    cuts = np.sort(cuts)
    side = np.searchsorted(cuts, at, side="right")
    bounds = np.concatenate([[-np.inf], cuts, [np.inf]])
    low = np.searchsorted(time, np.maximum(at - half, bounds[side]), side="left")
    high = np.searchsorted(time, np.minimum(at + half, bounds[side + 1]), side="right")
    few = high - low < 4
    low, high = np.minimum(low, time.size - 1), np.maximum(high, low + 1)
    high = np.minimum(np.maximum(high, low + 1), time.size)
    size = high - low
    first = np.concatenate([[0], np.cumsum(size)[:-1]])
    owner = np.repeat(np.arange(size.size), size)
    index = np.arange(size.sum()) - np.repeat(first - low, size)
    s = (time[index] - at[owner]) / max(half, step)
    w = 1.0 / np.maximum(stderr[index], 1e-3 * float(np.median(stderr)) + 1e-15) ** 2
    shift = value[low]
    v = value[index] - shift[owner]
    m0, m1, m2, y0, y1 = (np.add.reduceat(f, first) for f in (w, w * s, w * s**2, w * v, w * v * s))
    det = m0 * m2 - m1**2
    line = np.where(det > 1e-9 * m0 * m2, (m2 * y0 - m1 * y1) / np.where(det == 0, 1, det), y0 / m0)
    result = shift + line
    result[few] = np.interp(at[few], time, value)
    result[outside] = np.nan
    return result
