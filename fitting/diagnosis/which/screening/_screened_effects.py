"""Screened effects: which are worth a refit, and which lead on the flexible base."""

import dataclasses
from collections.abc import Callable
from functools import cached_property

from fitting.diagnosis.which._thresholds import THRESHOLDS

from ._screen import Screened


@dataclasses.dataclass(frozen=True, eq=False)
class ScreenedEffects:
    """Screened guesses of each effect by its name, the largest score first; none is empty.

    A base that misfits gives large scores to what stands in for another hysteresis; the flexible
    base takes that away, and gives small ones to what it has adapted to. So either counts, but for
    what must explain `least` beyond the flexible base. `telling`: whether scores beyond that base
    tell anything; where they do not, every effect is promising and none leads.
    """

    guesses: dict[str, list[Screened]]
    telling: bool = True
    least: float = 0.0

    @cached_property
    def promising(self) -> dict[str, list[Screened]]:
        """Effects that explain more than a small share of the best's, on either base."""
        if not self.telling:
            return self.guesses
        share = THRESHOLDS.screened_fall
        kept = self._near_best(lambda one: one.score, share)
        kept |= self._near_best(lambda one: one.flexible_score, share)
        return {
            name: each
            for name, each in self.guesses.items()
            if name in kept and max(one.flexible_score for one in each) >= self.least
        }

    @cached_property
    def leading_on_flexible_base(self) -> frozenset[str]:
        """Effects that explain nearly as much as the best, and more than chance, beyond it."""
        if not self.telling:
            return frozenset()
        near = self._near_best(lambda one: one.flexible_score, THRESHOLDS.leader_fall)
        best = {name: max(g.flexible_score for g in self.guesses[name]) for name in near}
        return frozenset(name for name in near if best[name] > THRESHOLDS.chance_fall)

    def by_flexible_score(self, name: str) -> list[Screened]:
        """The guesses of an effect, the largest score on the flexible base first."""
        return sorted(self.guesses[name], key=lambda one: -one.flexible_score)

    def _near_best(self, score: Callable[[Screened], float], share: float) -> set[str]:
        best = {name: max(map(score, each)) for name, each in self.guesses.items()}
        least = share * max(best.values(), default=0.0)
        return {name for name, value in best.items() if value >= least}
