"""Refits of one more effect with the base integrated out: a few parameters, and next to no cost."""

import dataclasses

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.which._thresholds import THRESHOLDS
from fitting.diagnosis.which.jumps._jump_search import search_jump_parameters

from ._screen import Screened
from ._screened_effects import guesses_to_refine


def refine_guesses(
    marginal: Refit, state: State, guesses: dict[str, list[Screened]]
) -> dict[str, list[Screened]]:
    """The guesses of each effect, and its best refitted beside `state`'s, where it gains by that.

    A score is linear in one size: of an effect with several parameters, or one that jumps, it may
    be a small share of what the effect explains. The best guess of each kind is refitted that
    scores nearly as well, as of a creep with and without rests between runs, and those of another
    signature that do, see `guesses_to_refine`. Effects that explain next to nothing of what the
    best one does are left as they are.

    `marginal`: see `FlexibleBase.marginal`.
    """
    without = marginal.evaluate(state.values, state.effects)
    if state.effects:  # their own refit beside that base is not another effect's doing
        without = marginal.minimise(without, THRESHOLDS.refined_steps)
    best = {name: max(each, key=lambda one: one.flexible_score) for name, each in guesses.items()}
    most = max((one.flexible_score for one in best.values()), default=0.0)
    least = max(THRESHOLDS.refined_share * most, THRESHOLDS.screened_chance)
    out = dict(guesses)
    for name, one in best.items():
        if one.flexible_score < least:
            continue
        for begin in guesses_to_refine(guesses[name]):
            refined = _refit(marginal, without, begin)
            if refined.effect is begin.effect:
                out[name] = [refined if guess is begin else guess for guess in out[name]]
            else:
                out[name] = [*out[name], refined]
    return out


def _refit(marginal: Refit, without: State, one: Screened) -> Screened:
    """A guess refitted, or as it is where it then explains no more than its score says."""
    start = marginal.evaluate(without.values, one.beside(without.effects))
    if not np.isfinite(start.cost):
        return one
    if not type(one.effect).smooth:
        start = search_jump_parameters(marginal, start, without.cost)
    end = marginal.minimise(start, THRESHOLDS.refined_steps)
    fall = without.cost - end.cost
    if not fall > one.flexible_score:
        return dataclasses.replace(one, refined=True)
    known = {effect.name for effect in without.effects}
    (effect,) = (e for e in end.effects if e.name not in known)
    loose = without.nonsynchronous - end.nonsynchronous
    return dataclasses.replace(
        one,
        effect=effect,
        flexible_score=float(fall),
        refined=True,
        nonsynchronous_score=float(max(loose, 0.0)),
    )
