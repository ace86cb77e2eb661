"""Whether what a hypothesis leaves could be a richer hysteresis, or needs another name."""

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._flexible_base import FlexibleBase
from ._thresholds import THRESHOLDS


def is_beyond_hysteresis(refit: Refit, state: State) -> bool:
    """Whether a density of plays leaves more of a refit than base misfit and chance do.

    `refit`, `state`: of the identified operator with the effects that are named. The effects follow
    once more with the plays integrated out. Where noise is not known nothing can be said: no.
    """
    if not refit.whitener.spectrum.measured or not np.isfinite(state.cost):
        return False
    marginal = FlexibleBase.about(refit, state).marginal
    end = marginal.minimise(
        marginal.evaluate(state.values, state.effects), THRESHOLDS.remainder_steps
    )
    lines = end.errors.synchronous.size
    chance = THRESHOLDS.remainder_sigmas * np.sqrt(2.0 / lines)
    return bool(end.synchronous > (THRESHOLDS.remainder + chance) * lines)
