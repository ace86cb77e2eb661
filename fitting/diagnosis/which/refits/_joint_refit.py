"""Refits of two effects at once, from the pairs that explain most together."""

import numpy as np

from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._effect_sets import insert_effect
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.screening._joint_screen import screen_pairs
from fitting.diagnosis.which.screening._screen import InitialGuesses

from ._density_refit import refit_about_or_on_density
from ._leading_effects import make_candidate


def refit_pairs_at_once(free: Refit, none: Candidate, guesses: InitialGuesses) -> list[Candidate]:
    """Pairs refitted together, first with the base and the plays' weights integrated out.

    `free`: with all of the operator free, of a recording whose noise is measured. `guesses`: by
    what `none` leaves.
    """
    start = none.on_base
    flexible = FlexibleBase.about(free, start)
    marginal, out = flexible.marginal, []
    for pair in screen_pairs(free, start, flexible, guesses):
        effects = start.effects
        for effect in pair:
            effects = insert_effect(effects, effect)
        state = marginal.evaluate(start.values, effects)
        if not np.isfinite(state.cost):
            continue
        end = marginal.minimise(state, THRESHOLDS.joint_steps)
        ends = refit_about_or_on_density(free, marginal, end, none)
        out.append(make_candidate(none, free, ends[0], ends, 1.0))
    return out
