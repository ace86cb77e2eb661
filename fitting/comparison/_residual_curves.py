"""What one model leaves of two recordings over a period, at the drives that both have."""

from typing import Any

import numpy as np
from jaxtyping import Float

from rapi_jax import Recording

from ._response_change import ModelErrors

_POINTS = 200  # of a period
_DIGITS = 3  # in which rates and swings of the two are the same

Drive = tuple[float, float]  # rate in Hz, swing
Curve = Float[np.ndarray, " points"]


def residual_curves(
    left: tuple[ModelErrors, ModelErrors], pair: tuple[Recording, Recording]
) -> list[dict[str, Any]]:
    """Data less model by rate and swing of both, the mean over the periods, and its own mean off.

    `left`: of each recording, by one model. At so many parts of a period since the drive's minimum;
    a part without a reading is NaN. Empty where the two have no periodic drive in common.
    """
    before, after = (_curves(*one) for one in zip(left, pair, strict=True))
    period = ((np.arange(_POINTS) + 0.5) / _POINTS).tolist()
    return [
        {"excitation_hz": rate, "amplitude": swing, "period": period}
        | {"before": before[rate, swing].tolist(), "after": after[rate, swing].tolist()}
        for rate, swing in sorted(before.keys() & after.keys())
    ]


def _curves(left: ModelErrors, recording: Recording) -> dict[Drive, Curve]:
    blocks = left.whitened.blocks
    sums: dict[Drive, tuple[Curve, Curve]] = {}
    for drive, block, error in zip(recording.drives, blocks, left.errors, strict=True):
        if drive.excitation_hz is None or not block.repeats:
            continue
        rate, swing = (float(f"{x:.{_DIGITS}g}") for x in (drive.excitation_hz, drive.u_pp))
        part = np.minimum((block.phase * _POINTS).astype(int), _POINTS - 1)
        weight = np.bincount(part, block.use.sum(axis=0), _POINTS)
        total = np.bincount(part, -(error * block.use).sum(axis=0), _POINTS)
        known = sums.get((rate, swing), (np.zeros(_POINTS), np.zeros(_POINTS)))
        sums[rate, swing] = known[0] + weight, known[1] + total
    return {drive: _centred(*both) for drive, both in sums.items() if both[0].any()}


def _centred(weight: Curve, total: Curve) -> Curve:
    with np.errstate(invalid="ignore"):
        curve = total / np.where(weight > 0, weight, np.nan)
    return curve - np.nanmean(curve)
