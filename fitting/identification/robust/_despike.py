"""Residuals without single large values, for checks that look for jumps."""

import numpy as np
from jaxtyping import Bool, Float
from numpy.lib.stride_tricks import sliding_window_view

from fitting.identification._thresholds import THRESHOLDS

from ._loss import Huber


def despike(
    error: Float[np.ndarray, "runs time"], use: Bool[np.ndarray, "runs time"]
) -> Float[np.ndarray, "runs time"]:
    """`error` with what stands far from the median about it drawn near; jumps that last remain."""
    width = THRESHOLDS.despike_samples
    out = error.copy()
    for row, used in enumerate(use):
        values = error[row, used]
        if values.size < width:
            continue
        about = sliding_window_view(np.pad(values, width // 2, mode="reflect"), width)
        middle = np.median(about, axis=1)
        apart = values - middle
        scale = 1.4826 * float(np.median(np.abs(apart)))
        if scale > 0:
            share = Huber(THRESHOLDS.huber_corner).weight(apart / scale)
            out[row, used] = middle + share * apart
    return out
