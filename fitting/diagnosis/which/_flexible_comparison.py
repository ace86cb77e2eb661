"""Candidates beside each other on the flexible base, where only what no hysteresis does counts."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.base_misfit._density import SCALES
from fitting.diagnosis.base_misfit._flexible_base import FlexibleBase
from fitting.diagnosis.refit._gauss_newton import Refit, State
from rapi_jax.effects import AbstractEffect

from ._candidate import Candidate, insert_effect
from ._effect_refit import refit_and_search
from ._thresholds import THRESHOLDS


def refit_effects(base: FlexibleBase, on_base: State, cost_without: float) -> State:
    """The effects of a refit on the identified base, refitted on the flexible one.

    `cost_without`: chi-square without them.
    """
    start = base.marginal.evaluate(on_base.values, on_base.effects)
    if not start.effects or not np.isfinite(start.cost):
        return start
    return refit_and_search(base.marginal, start, cost_without)


def place_effects(base: FlexibleBase, on_base: State) -> State:
    """The same without a search for the places of jumps."""
    start = base.marginal.evaluate(on_base.values, on_base.effects)
    if not start.effects or not np.isfinite(start.cost):
        return start
    return base.marginal.minimise(start, THRESHOLDS.flexible_steps, THRESHOLDS.flexible_tolerance)


def compare_on_flexible_base(
    refit: Refit, none: Candidate, others: Sequence[Candidate]
) -> tuple[Candidate, list[Candidate]]:
    """None, and the candidates with effects, each with a density of plays about its own refit.

    One scale for all, that of the greatest evidence of any. Costs are nested: no candidate costs
    more than one whose effects are among its own, since it may stay there with its further effect
    at the identity.
    """
    bases = {c.name: FlexibleBase.about(refit, c.on_base) for c in (none, *others)}
    most = max(bases.values(), key=lambda base: base.log_evidence.max())
    scale = float(SCALES[int(np.argmax(most.log_evidence))])
    bases = {name: base.with_scale(scale) for name, base in bases.items()}
    none = _best_without(none, others, bases[none.name])
    found = {none.name: none}
    for candidate in sorted(others, key=lambda c: len(c.effects)):
        base = bases[candidate.name]
        state = refit_effects(base, candidate.on_base, none.cost)
        for parent in list(found.values()):
            nested = _names(parent.effects) < _names(candidate.effects)
            if nested and not state.cost <= parent.cost:
                base, state = parent.flexible, _refit_from_parent(parent, candidate)
        found[candidate.name] = _placed(candidate, base, state)
    return none, [found[c.name] for c in others]


def _best_without(none: Candidate, others: Sequence[Candidate], base: FlexibleBase) -> Candidate:
    """Without effects: from the base's own values, or from those beside the best candidate.

    The former may be far off where an effect is missing.
    """
    here = _placed(none, base, base.marginal.evaluate(none.on_base.values, none.on_base.effects))
    best = min(others, key=lambda c: c.on_base.cost)
    start = base.refit.evaluate(best.on_base.values, none.on_base.effects)
    if not np.isfinite(start.cost):
        return here
    beside = FlexibleBase.about(base.refit, start).with_scale(base.scale)
    there = _placed(none, beside, beside.marginal.evaluate(start.values, start.effects))
    return there if there.cost < here.cost else here


def _refit_from_parent(parent: Candidate, candidate: Candidate) -> State:
    """The further effects of `candidate` beside `parent`, from where they change nothing."""
    state, marginal = parent.on_flexible_base, parent.flexible.marginal
    effects = state.effects
    for effect in candidate.effects:
        if effect.name not in _names(effects):
            effects = insert_effect(effects, _identity(type(effect)))
    start = marginal.evaluate(state.values, effects)
    return refit_and_search(marginal, start, state.cost)


def _identity(cls: type[AbstractEffect]) -> AbstractEffect:
    """An effect that changes nothing: its defaults."""
    return cls()  # pyright: ignore[reportCallIssue]


def _placed(candidate: Candidate, base: FlexibleBase, state: State) -> Candidate:
    effects = tuple(e for e in state.effects if e.name in _names(candidate.effects))
    return dataclasses.replace(candidate, effects=effects, flexible=base, on_flexible_base=state)


def _names(effects: Sequence[AbstractEffect]) -> set[str]:
    return {effect.name for effect in effects}
