"""First guesses of amplitudes by least squares on the residual, and peaks of a spectrum."""

import numpy as np
from jaxtyping import Float

from rapi_jax.effects._thresholds import THRESHOLDS

from ._residual_summary import ResidualSummary


def fit_amplitude(summary: ResidualSummary, signature: Float[np.ndarray, " samples"]) -> float:
    """The least-squares amplitude of `signature` in the residual, beside a constant.

    At least the detectable amplitude, with the sign of the estimate: never zero, never NaN.
    """
    good = np.isfinite(signature) & np.isfinite(summary.residual)
    if not good.any():
        return detectable_amplitude(summary)
    shape = signature[good] - signature[good].mean()
    power = float(shape @ shape)
    rms = np.sqrt(power / shape.size)
    if not (np.isfinite(power) and rms > 1e-12 * np.abs(signature[good]).max(initial=0.0)):
        return detectable_amplitude(summary)
    found = float(shape @ summary.residual[good]) / power
    floor = detectable_amplitude(summary) / rms
    return found if abs(found) >= floor else float(np.copysign(floor, found))


def detectable_amplitude(summary: ResidualSummary) -> float:
    """The smallest amplitude that shows in the response, in its unit: that of the noise."""
    for value in (summary.noise, THRESHOLDS.least_amplitude_of_span * summary.span):
        if np.isfinite(value) and value > 0:
            return float(value)
    return THRESHOLDS.least_amplitude


def residual_power(summary: ResidualSummary) -> float:
    """Mean square of the residual about its mean in each run; at least the detectable one."""
    total = sum(
        float(np.nansum((part - np.nanmean(part)) ** 2))
        for part in (summary.residual[summary.run == k] for k in np.unique(summary.run))
        if np.isfinite(part).any()
    )
    return max(total / max(summary.residual.size, 1), detectable_amplitude(summary) ** 2)


def find_peaks(height: Float[np.ndarray, " grid"], count: int, apart: int = 1) -> list[int]:
    """Indices of the highest local maxima: at most `count`, more than `apart` steps apart."""
    padded = np.concatenate([[-np.inf], height, [-np.inf]])
    top = np.flatnonzero((height >= padded[:-2]) & (height > padded[2:]))
    chosen: list[int] = []
    for i in top[np.argsort(-height[top], kind="stable")]:
        if len(chosen) == count:
            break
        if all(abs(int(i) - other) > apart for other in chosen):
            chosen.append(int(i))
    return chosen
