"""Costs on the flexible base are nested: an effect added never costs.

A refit may end in another minimum than the one of fewer effects. It is then begun anew where that
one ended, with the further effect at no strength: there both cost the same.
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.refit._effect_vector import (
    effect_values,
    free_parameters,
    strength_names,
    with_values,
)
from rapi_jax.effects import AbstractEffect, ResidualSummary

from ._candidate import Candidate
from ._effect_sets import insert_effect
from .refits._flexible_refit import refit_and_search
from .screening._screen import summarise_residual

_ROUNDING = 1e-9  # of chi-square


def nest_costs(none: Candidate, candidates: Sequence[Candidate]) -> list[Candidate]:
    """The candidates, none of them at more chi-square than one whose effects are among its own."""
    found = [none]
    for candidate in sorted(candidates, key=lambda c: len(c.effects)):
        names = _names(candidate)
        parent = min((c for c in found if _names(c) < names), key=lambda c: c.cost)
        nested = candidate.cost <= parent.cost
        found.append(candidate if nested else _refit_from(parent, candidate))
    by_name = {c.name: c for c in found}
    return [by_name[c.name] for c in candidates]


def _refit_from(parent: Candidate, candidate: Candidate) -> Candidate:
    """The further effects of `candidate`, from no strength, beside `parent`."""
    refit, state = parent.flexible_refit, parent.on_flexible_base
    further = [e for e in candidate.effects if e.name not in {e.name for e in state.effects}]
    noise = float(np.sqrt(refit.whitener.spectrum.total))
    summary = summarise_residual(refit.whitened, state, noise)
    for weak in ([without_strength(e, summary) for e in further], [type(e).at() for e in further]):
        effects = state.effects
        for effect in weak:
            effects = insert_effect(effects, effect)
        start = refit.evaluate(state.values, effects)
        if start.cost <= state.cost * (1.0 + _ROUNDING):
            break
    end = start
    if np.isfinite(effect_values(start.effects)).all():
        end = refit_and_search(refit, start, state.cost)
    kept = tuple(e for e in end.effects if e.name in _names(candidate))
    return dataclasses.replace(candidate, effects=kept, on_flexible_base=end, flexible_refit=refit)


def without_strength(effect: AbstractEffect, summary: ResidualSummary) -> AbstractEffect:
    """An effect of the same kind that is about to change a recording."""
    onset, values = effect_values((type(effect).onset(summary),)), effect_values((effect,))
    strong = strength_names(effect)
    for k, p in enumerate(free_parameters(effect)):
        if p.path[0] in strong:
            values[k] = onset[k]
    return with_values((effect,), values)[0]


def _names(candidate: Candidate) -> set[str]:
    return {effect.name for effect in candidate.effects}
