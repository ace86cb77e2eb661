"""Screened effects: which are worth a refit, and which lead on the flexible base."""

import dataclasses
from collections.abc import Callable
from functools import cached_property

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.which._thresholds import THRESHOLDS

from ._screen import Screened


def may_explain(guesses: list[Screened], whole: float, nonsynchronous: float = np.inf) -> bool:
    """Whether an effect may explain as much beyond the flexible base.

    `whole`: of all chi-square. `nonsynchronous`: of that of what does not repeat, if that is less
    to ask. Foreseen from the largest score of its guesses, and whether one of them was refitted
    there.
    """
    best = max(guesses, key=lambda one: one.flexible_score)
    if not any(one.refined for one in guesses):
        most = THRESHOLDS.foreseen_of_grid
    elif type(best.effect).smooth:
        most = THRESHOLDS.foreseen_of_refit
    else:
        most = THRESHOLDS.foreseen_of_jumps
    loose = max(one.nonsynchronous_score for one in guesses)
    return most * best.flexible_score >= whole or most * loose >= nonsynchronous


def best_of_each_kind(guesses: list[Screened]) -> list[Screened]:
    """Of each kind and order of an effect the guess that explains most beyond the flexible base.

    Those that explain nearly as much as the best, which comes first.
    """
    best: dict[tuple[str, bool], Screened] = {}
    for one in sorted(guesses, key=lambda one: -one.flexible_score):
        best.setdefault((one.effect.kind(), one.other_order), one)
    first, *others = best.values()
    least = THRESHOLDS.other_kind_share * first.flexible_score
    return [first, *(one for one in others if one.flexible_score > least)]


def guesses_to_refine(guesses: list[Screened]) -> list[Screened]:
    """The best of each kind, and a few more that score nearly as well by another signature.

    A score is that of a guess as it stands: of two tones that runs far apart hardly tell, the right
    one, a hundredth of a hertz off or at another phase, may score less than the other.
    """
    chosen = best_of_each_kind(guesses)
    if not type(chosen[0].effect).smooth:  # each takes a search for its jumps
        return chosen
    least = THRESHOLDS.near_guess_share * chosen[0].flexible_score
    most = len(chosen) + THRESHOLDS.near_guesses
    for one in sorted(guesses, key=lambda one: -one.flexible_score):
        if one.flexible_score < least or len(chosen) == most:
            break
        if not any(one is other or one.is_parallel(other) for other in chosen):
            chosen.append(one)
    return chosen


@dataclasses.dataclass(frozen=True, eq=False)
class ScreenedEffects:
    """Screened guesses of each effect by its name, the largest score first; none is empty.

    A base that misfits gives large scores to what stands in for another hysteresis; the flexible
    base takes that away. So scores beyond it decide, but for effects that it could take up as well:
    of those it cannot tell. `telling`: whether the flexible base tells anything; where noise is not
    known every effect is promising, and none leads. `least`: the least score beyond it that counts.
    `in_any_case`: effects that are promising whatever their scores. `most`: how many may lead.
    `marginal`: refits on that flexible base, about the base without the effects, if there is one.
    `nothing_left`: whether the flexible base leaves no more than noise. Then it need not be asked
    what it takes up: the evidence would name no effect that explains no more beyond it.
    """

    guesses: dict[str, list[Screened]]
    telling: bool = True
    least: float = 0.0
    in_any_case: frozenset[str] = frozenset()
    most: int | None = None
    nothing_left: bool = False
    marginal: Refit | None = None

    @cached_property
    def promising(self) -> dict[str, list[Screened]]:
        """Effects that explain a share of what the best explains beyond the flexible base.

        And those near the best on the identified base, of which the flexible base cannot tell.
        """
        if not self.telling:
            return self.guesses
        share = THRESHOLDS.screened_fall
        kept = self._near_best(lambda one: one.flexible_score, share, self.least)
        near = self._near_best(lambda one: one.score, share, self.least)
        if not self.nothing_left:
            kept |= {name for name in near if self._is_taken_up(name)}
        kept |= self.in_any_case
        return {name: each for name, each in self.guesses.items() if name in kept}

    @cached_property
    def leading_on_flexible_base(self) -> frozenset[str]:
        """Effects that explain nearly as much as the best, and more than chance, beyond it."""
        if not self.telling:
            return frozenset()
        share, least = THRESHOLDS.leader_fall, max(self.least, THRESHOLDS.chance_fall)
        near = self._near_best(lambda one: one.flexible_score, share, least)
        first = sorted(near, key=lambda name: -max(g.flexible_score for g in self.guesses[name]))
        return frozenset(first[: self.most])

    @property
    def without_leading(self) -> "ScreenedEffects":
        """The promising ones that do not lead."""
        leading = self.leading_on_flexible_base
        kept = {name: each for name, each in self.promising.items() if name not in leading}
        return dataclasses.replace(self, guesses=kept, in_any_case=frozenset(kept))

    def best_on_flexible_base(self, name: str) -> Screened:
        """The guess of an effect with the largest score beyond the flexible base."""
        return max(self.guesses[name], key=lambda one: one.flexible_score)

    def starts_on_flexible_base(self, name: str) -> list[list[Screened]]:
        """The guesses to begin from: of each kind the best, or, where it jumps, all that are tied.

        Steps of many sizes have one signature, as it is sampled, until the base has followed them.
        """
        best = self.best_on_flexible_base(name)
        if type(best.effect).smooth:
            return [[one] for one in best_of_each_kind(self.guesses[name])]
        least = THRESHOLDS.tied_share * best.flexible_score
        tied = [one for one in self.guesses[name] if one.flexible_score >= least]
        tied.sort(key=lambda one: -one.flexible_score)
        return [tied[: THRESHOLDS.tied_guesses]]

    def _is_taken_up(self, name: str) -> bool:
        """Whether an effect would explain no more than chance beyond the flexible base.

        Also were all that it explains on the identified base its own doing.
        """
        best = max(self.guesses[name], key=lambda one: one.score)
        return best.expected_score < THRESHOLDS.chance_fall

    def _near_best(
        self, score: Callable[[Screened], float], share: float, least: float
    ) -> set[str]:
        best = {name: max(map(score, each)) for name, each in self.guesses.items()}
        limit = max(share * max(best.values(), default=0.0), least)
        return {name for name, value in best.items() if value >= limit}
