"""Whether what a hypothesis leaves could be a richer hysteresis, or needs another name."""

import numpy as np

from fitting.diagnosis.refit._gauss_newton import State

from ._thresholds import THRESHOLDS


def is_beyond_hysteresis(left: State) -> bool:
    """Whether more is left beside a density of plays than base misfit and chance.

    `left`: the end of a refit on a density, of the effects that are named; see `FlexibleBase`.
    """
    if not np.isfinite(left.cost):
        return False
    lines = left.errors.synchronous.size
    chance = THRESHOLDS.remainder_sigmas * np.sqrt(2.0 / lines)
    return bool(left.synchronous > (THRESHOLDS.remainder + chance) * lines)
