"""Background and visibility of the fringes, both slowly changing."""

import numpy as np
from scipy import ndimage


def envelope_from_extremes(value: np.ndarray, block: int) -> tuple[np.ndarray, np.ndarray]:
    """Offset and amplitude of each sample from the extremes of blocks of several fringes.

    Blocks whose range is short beside their neighbours' hold less than a fringe (a slow turn) and
    take both from them.
    """
    blocks = max(1, value.size // block)
    kept = value[: blocks * block].reshape(blocks, -1)
    high, low = kept.max(axis=1), kept.min(axis=1)
    span = high - low
    short = span < 0.8 * ndimage.maximum_filter1d(ndimage.median_filter(span, 3), 21)
    if short.any() and not short.all():
        at = np.arange(blocks)
        high = np.interp(at, at[~short], high[~short])
        low = np.interp(at, at[~short], low[~short])
    if blocks >= 5:
        high, low = ndimage.median_filter(high, 5), ndimage.median_filter(low, 5)
    centre = (np.arange(blocks) + 0.5) * block - 0.5
    at = np.arange(value.size)
    high, low = np.interp(at, centre, high), np.interp(at, centre, low)
    return (high + low) / 2, np.maximum((high - low) / 2, 1e-30)


def fit_envelope(
    value: np.ndarray, good: np.ndarray, phase: np.ndarray, travel: np.ndarray, fringes: float = 6.0
) -> tuple[np.ndarray, np.ndarray]:
    """Offset and amplitude by least squares of `B + A cos(phase)` over blocks of `fringes`.

    `travel` is the path of the phase in fringes, growing at turns too.
    """
    block = np.minimum((travel - travel[0]) / fringes, 1e7).astype(int)
    count = int(block[-1]) + 1
    cosine = np.cos(phase)
    # By path, not by time: at a slow turn many samples see one phase, and that one the least known.
    step = np.gradient(travel)
    w = good * np.minimum(step / np.median(step), 1.0)
    sums = [
        np.bincount(block, weights=w * f, minlength=count)
        for f in (1.0, cosine, cosine**2, value, value * cosine, travel)
    ]
    n, c, cc, y, yc, where = sums
    det = n * cc - c**2
    usable = (n > 8) & (det > 0.1 * n**2)
    if not usable.any():
        return np.full_like(value, value.mean()), np.full_like(value, np.ptp(value) / 2)
    n, c, cc, y, yc, where, det = (a[usable] for a in (n, c, cc, y, yc, where, det))
    amplitude = (n * yc - c * y) / det
    offset = (y - amplitude * c) / n
    where = where / n
    if amplitude.size >= 5:
        amplitude, offset = ndimage.median_filter(amplitude, 3), ndimage.median_filter(offset, 3)
    return (
        np.interp(travel, where, offset),
        np.maximum(np.interp(travel, where, amplitude), 1e-6 * np.abs(amplitude).max()),
    )
