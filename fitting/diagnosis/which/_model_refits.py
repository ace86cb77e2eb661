"""Candidates as models to be used: on the identified operator, or on the flexible one.

Which effect is missing is judged with the base's misfit integrated out; a model that predicts needs
the richer hysteresis itself, as an operator. Only the models that are handed over or held out pay
for that search.
"""

import dataclasses

import numpy as np

from fitting.diagnosis.base_misfit._flexible_operator import flexible_operator
from fitting.diagnosis.refit._gauss_newton import Refit, State

from ._candidate import Candidate
from ._effect_refit import refit_and_search
from ._excess import is_unexplained
from ._thresholds import THRESHOLDS


def needs_flexible_operator(candidate: Candidate) -> bool:
    """Whether the identified operator leaves more than noise, and a richer one would not."""
    base, flexible = (
        state.synchronous - state.errors.synchronous.size
        for state in (candidate.on_base, candidate.on_flexible_base)
    )
    more = base > THRESHOLDS.flexible_base_ratio * max(flexible, 0.0)
    return is_unexplained(candidate.on_base) and more


class ModelRefits:
    """The refit of each candidate that is asked for, found once.

    `refit`: of the identified operator. `flexible`: whether all stand on the flexible operator.
    """

    def __init__(self, refit: Refit, none: Candidate, *, flexible: bool) -> None:
        self.refit, self.none, self.flexible = refit, none, flexible
        self._known: dict[str, tuple[Refit, State]] = {}

    def of(self, candidate: Candidate) -> tuple[Refit, State]:
        """The refit and where it ended."""
        if not self.flexible:
            return self.refit, candidate.on_base
        if candidate.name not in self._known:
            self._known[candidate.name] = self._find(candidate)
        return self._known[candidate.name]

    def _find(self, candidate: Candidate) -> tuple[Refit, State]:
        """From the candidate's own base, or from that without effects; the better of the two."""
        own = _start(self.refit, candidate.on_base)
        if candidate.name == self.none.name:
            refit, start = own
            steps, tolerance = THRESHOLDS.flexible_steps, THRESHOLDS.flexible_tolerance
            return refit, refit.minimise(start, steps, tolerance)
        other, before = self.of(self.none)
        beside = other.evaluate(before.values, candidate.on_base.effects)
        starts = [pair for pair in (own, (other, beside)) if np.isfinite(pair[1].cost)]
        refit, start = min(starts, key=lambda pair: pair[1].cost)
        return refit, refit_and_search(refit, start, before.cost)


def _start(refit: Refit, state: State) -> tuple[Refit, State]:
    """The flexible operator at a state; the identified one where that has no such form."""
    base = flexible_operator(refit.whitened, refit.base, state.values)
    if base is None:
        return refit, state
    flexible = dataclasses.replace(refit, base=base)
    return flexible, flexible.evaluate(base.prior_mean, state.effects)
