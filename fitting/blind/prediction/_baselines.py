"""Baseline methods that name an effect, scored beside the diagnosis on the same devices.

- `correlation`: the effect whose signature correlates most with what the fitted base leaves, with
  nothing projected out.
- `jacobian`: the score test with the base's own Jacobian projected out, and no flexible base.
- `aic`: forward selection by Akaike's criterion on all the data, refitted with the paper's base.
- `lowpass`: always the amplifier's low-pass. `random`: any answer, all alike.

Only `random` ever gives the verdict `unlisted`.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy.stats import chi2

from fitting.blind.protocol._verdict_names import NONE, UNLISTED
from fitting.diagnosis.noise._periods import decimate
from fitting.diagnosis.refit._effect_vector import Effects, free_parameters
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import FittedBase, fit_base
from fitting.diagnosis.which._effect_sets import hypothesis_name
from fitting.diagnosis.which.refits._effect_refit import full_refit, short_refit
from fitting.diagnosis.which.screening._base_remainder import BaseRemainder, orthonormal_basis
from fitting.diagnosis.which.screening._screen import (
    Screened,
    initial_guesses,
    screen_effect,
    search_ranges,
)
from rapi_jax import Recording
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import float64

from ._thresholds import THRESHOLDS

LOWPASS = "amplifier_lowpass"
Classes = Sequence[type[AbstractEffect]]


@float64
@np.errstate(over="ignore", invalid="ignore")  # a refit that runs away has no finite cost
def baseline_verdicts(
    recording: Recording, candidates: Classes, *, seed: int, fitted: FittedBase | None = None
) -> dict[str, str]:
    """The verdict of each baseline: `none`, names joined by +, or `unlisted`.

    `seed`: of the random answer. `fitted`: the base where it was fitted already.
    """
    if fitted is None:
        fitted = fit_base(WhitenedModel.of(decimate(recording)), None)
    trials = initial_guesses(fitted.refit, fitted.state, candidates)
    edges = {k: v for grid in trials.values() for k, v in search_ranges(grid).items()}
    refit = dataclasses.replace(fitted.refit, search_ranges=edges)
    state = fitted.state
    # Here `score` is with nothing projected out, `flexible_score` with the base's Jacobian.
    nothing = np.zeros((state.errors.synchronous.size, 0))
    inside = orthonormal_basis(refit.jacobian_base(state))
    beyond = BaseRemainder.beyond_tangent(state, inside)
    best = {
        name: screen_effect(refit, state, grid, nothing, beyond) for name, grid in trials.items()
    }
    rng = np.random.default_rng(seed)
    names = [NONE, *(cls.name for cls in candidates), UNLISTED]
    return {
        "correlation": largest_correlation(state, best),
        "jacobian": largest_score(best),
        "aic": forward_selection(refit, state, candidates, best),
        "lowpass": LOWPASS,
        "random": str(rng.choice(names)),
    }


def largest_correlation(state: State, screened: dict[str, list[Screened]]) -> str:
    """The largest correlation, if it is beyond what white noise of as many samples has."""
    # The fall of chi-square along one signature is its correlation squared, times chi-square.
    falls = {name: max((s.score for s in found), default=0.0) for name, found in screened.items()}
    name, fall = _largest(falls)
    size = state.errors.synchronous.size + state.errors.nonsynchronous.size
    return (
        name
        if fall / (state.synchronous + state.nonsynchronous)
        > chi2.isf(THRESHOLDS.baseline_level, 1) / size
        else NONE
    )


def largest_score(screened: dict[str, list[Screened]]) -> str:
    """The largest score, if it is beyond chi-square's 1 % point for one look."""
    falls = {
        name: max((s.flexible_score for s in found), default=0.0)
        for name, found in screened.items()
    }
    name, fall = _largest(falls)
    return name if fall > chi2.isf(THRESHOLDS.baseline_level, 1) else NONE


def forward_selection(
    refit: Refit, state: State, candidates: Classes, screened: dict[str, list[Screened]]
) -> str:
    """Effects added one by one while `chi2 + 2 k` falls, three at most."""
    effects_found: Effects = ()
    while len(effects_found) < THRESHOLDS.selected_effects:
        found = _best_addition(refit, state, screened)
        if found is None or _aic(found) >= _aic(state):
            break
        state, effects_found = found, found.effects
        left = [cls for cls in candidates if cls.name not in {e.name for e in effects_found}]
        if len(effects_found) < THRESHOLDS.selected_effects:
            inside = orthonormal_basis(refit.jacobian_base(state))
            beyond = BaseRemainder.beyond_tangent(state, inside)
            grids = initial_guesses(refit, state, left)
            screened = {
                n: screen_effect(refit, state, grid, inside, beyond) for n, grid in grids.items()
            }
    return hypothesis_name(effects_found)


def _best_addition(refit: Refit, state: State, screened: dict[str, list[Screened]]) -> State | None:
    """The refit with the one more effect that leaves least by Akaike's criterion."""
    best = [max(found, key=lambda one: one.flexible_score) for found in screened.values() if found]
    best = sorted(best, key=lambda one: -one.flexible_score)[: THRESHOLDS.short_refits]
    looks = [look for one in best if (look := short_refit(refit, state, [one])) is not None]
    ends = [
        full_refit(refit, look, state.cost)
        for look in sorted(looks, key=_aic)[: THRESHOLDS.full_refits]
    ]
    return min(ends, key=_aic, default=None)


def _aic(state: State) -> float:
    """Up to what all candidates share."""
    return state.cost + 2 * sum(len(free_parameters(effect)) for effect in state.effects)


def _largest(falls: dict[str, float]) -> tuple[str, float]:
    return max(falls.items(), key=lambda pair: pair[1], default=(NONE, 0.0))
