"""How large an effect would have to be to explain a residual: a first guess, never zero."""

import numpy as np
from jaxtyping import Float

from ._residual_summary import ResidualSummary
from ._thresholds import THRESHOLDS


def size(summary: ResidualSummary, signature: Float[np.ndarray, " samples"]) -> float:
    """The factor of `signature` that fits the residual best, beside a constant.

    A residual that shows nothing of it gives what would just be seen; never zero, never NaN.
    """
    good = np.isfinite(signature) & np.isfinite(summary.residual)
    if not good.any():
        return least(summary)
    shape = signature[good] - signature[good].mean()
    power = float(shape @ shape)
    rms = np.sqrt(power / shape.size)
    if not (np.isfinite(power) and rms > 1e-12 * np.abs(signature[good]).max(initial=0.0)):
        return least(summary)
    found = float(shape @ summary.residual[good]) / power
    floor = least(summary) / rms
    return found if abs(found) >= floor else float(np.copysign(floor, found))


def least(summary: ResidualSummary) -> float:
    """A response that would just be seen: of the noise's size, in the response's unit."""
    for value in (summary.noise, THRESHOLDS.least_amplitude_of_span * summary.span):
        if np.isfinite(value) and value > 0:
            return float(value)
    return THRESHOLDS.least_amplitude


def power(summary: ResidualSummary) -> float:
    """Mean square of the residual about its mean in each run, or of what would just be seen."""
    total = sum(
        float(np.nansum((part - np.nanmean(part)) ** 2))
        for part in (summary.residual[summary.run == k] for k in np.unique(summary.run))
        if np.isfinite(part).any()
    )
    return max(total / max(summary.residual.size, 1), least(summary) ** 2)


def peaks(height: Float[np.ndarray, " grid"], count: int, apart: int = 1) -> list[int]:
    """Places of the highest local maxima, at most `count`, at least `apart` steps from another."""
    padded = np.concatenate([[-np.inf], height, [-np.inf]])
    top = np.flatnonzero((height >= padded[:-2]) & (height > padded[2:]))
    chosen: list[int] = []
    for i in top[np.argsort(-height[top], kind="stable")]:
        if len(chosen) < count and all(abs(int(i) - other) > apart for other in chosen):
            chosen.append(int(i))
    return chosen
