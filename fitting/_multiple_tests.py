"""Correction of p-values for the number of tests made."""

import numpy as np
from jaxtyping import Float


def adjust_holm(p: Float[np.ndarray, " tests"]) -> Float[np.ndarray, " tests"]:
    """P-values by which the chance of any false rejection is held, whatever their dependence.

    Holm, S. (1979), *Scand. J. Statist.* 6:65-70. NaN is no test and stays NaN.
    """
    out = np.full(p.shape, np.nan)
    tested = np.flatnonzero(np.isfinite(p))
    order = tested[np.argsort(p[tested], kind="stable")]
    factor = order.size - np.arange(order.size)
    out[order] = np.minimum(1.0, np.maximum.accumulate(p[order] * factor))
    return out
