"""Hypotheses that a scan is to separate, and the odds between them that a scan would give.

The data so far and the scan together are judged by chi-square over a temperature (see `Tempering`)
that grows with what the effects in question explain: no effect follows its equation exactly. So
more readings of one scan make the wrong one only so improbable.
"""

import dataclasses
from collections.abc import Callable, Sequence
from itertools import combinations

import numpy as np

from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.which.evidence._tempering import Tempering
from rapi_jax.effects import AbstractEffect

from ._scan_batch import Rival
from ._thresholds import THRESHOLDS

Pair = tuple[int, int]  # which hypothesis is true, and which is refitted
_WITHOUT_PREDICTION = ("unlisted",)  # it predicts nothing, so no scan is planned for it


@dataclasses.dataclass(frozen=True, eq=False)
class Hypothesis:
    """Effects that may be at work, with all parameters as fitted to the data.

    `values`: see `WhitenedModel.operator_response`; with initial states of the old runs.
    """

    name: str
    effects: tuple[AbstractEffect, ...]
    values: np.ndarray
    probability: float

    @property
    def names(self) -> frozenset[str]:
        """Of its effects."""
        return frozenset() if self.name == "none" else frozenset(self.name.split("+"))


@dataclasses.dataclass(frozen=True, eq=False)
class RivalSet:
    """The rivals on the old data, and what the odds between each two depend on.

    `simpler`: hypotheses without the effects in which two rivals differ, and which of them it is
    for each pair, in `common`. `stake`: the chi-square that these effects explain in the old data,
    see `excess_at_stake`.
    """

    rivals: list[Rival]
    probability: list[float]
    tempering: Tempering
    simpler: list[Rival]
    common: dict[Pair, int]
    stake: dict[Pair, float]

    @classmethod
    def of(
        cls,
        refit: Refit,
        hypotheses: Sequence[Hypothesis],
        *,
        tempering: Tempering,
        stake: Callable[[frozenset[str], frozenset[str]], float],
        others: Sequence[Hypothesis] = (),
    ) -> "RivalSet":
        """`hypotheses` at their own fits. `stake`: of two by their effects' names.

        `others`: simpler hypotheses; where one that is needed is missing, the one without any
        effect stands for it, and where that is missing, too, nothing is at stake in a scan.
        """
        predicting = [h for h in hypotheses if h.name not in _WITHOUT_PREDICTION]
        known = {h.names: h for h in (*others, *hypotheses) if h.name not in _WITHOUT_PREDICTION}
        fits = {h.name: Rival.of(refit, h.name, h.values, h.effects) for h in predicting}
        needed: list[str] = []
        common, staked = {}, {}
        for i, j in combinations(range(len(predicting)), 2):
            one, other = predicting[i].names, predicting[j].names
            staked[i, j] = staked[j, i] = stake(one, other)
            simpler = known.get(one & other, known.get(frozenset()))
            if simpler is None:
                continue
            if simpler.name not in needed:
                needed.append(simpler.name)
            common[i, j] = common[j, i] = needed.index(simpler.name)
            if simpler.name not in fits:
                fit = Rival.of(refit, simpler.name, simpler.values, simpler.effects)
                fits[simpler.name] = fit
        return cls(
            [fits[h.name] for h in predicting],
            [h.probability for h in predicting],
            tempering,
            [fits[name] for name in needed],
            common,
            staked,
        )

    def log_odds(self, pair: Pair, power: float, stake: float) -> float:
        """Of the true hypothesis against the other after a scan, where they are even before it.

        `power`, `stake`: chi-square of the scan that the other cannot follow, and that the simpler
        one cannot.
        """
        temperature = self.tempering.temperature(self.stake.get(pair, 0.0) + stake)
        return 0.5 * power / self.tempering.misfit / temperature

    def repeats_needed(self, pair: Pair, power: float, stake: float) -> float:
        """How many times the scan's periods separate the pair; infinite where none do."""
        wanted = 2.0 * THRESHOLDS.separated_log_odds * self.tempering.misfit
        before = self.tempering.temperature(self.stake.get(pair, 0.0))
        gained = power - wanted * self.tempering.form * stake
        return wanted * before / gained if gained > 0 else np.inf


def probability_left(log_odds: float) -> float:
    """Of the wrong one of two hypotheses, at such odds against it."""
    return float(1.0 / (1.0 + np.exp(min(log_odds, 700.0))))
