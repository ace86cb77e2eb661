"""Candidate scans with their power: to first order for all, by joint refits for the leaders."""

import dataclasses
from itertools import permutations

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener

from ._candidates import Candidate
from ._discrimination import linear_discrimination
from ._rival_refit import refit_rival
from ._rival_set import Pair, RivalSet
from ._scan_batch import ScanBatch, ScanPrediction
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(eq=False)
class RatedScan:
    """One candidate: powers of its ordered pairs, to first order and by refits.

    `stake`: the chi-square of the scan that the effects in which a pair differs explain.
    """

    candidate: Candidate
    batch: ScanBatch
    k: int
    rivals: RivalSet
    predictions: list[ScanPrediction]
    first: dict[Pair, float]
    steps: dict[Pair, np.ndarray]
    stake: dict[Pair, float]
    checked: dict[Pair, float] = dataclasses.field(default_factory=dict)

    def power(self, pair: Pair) -> float:
        """The refitted power of a pair where there is one."""
        return self.checked.get(pair, self.first[pair])

    def log_odds(self, pair: Pair) -> float:
        """Against the wrong one of a pair after the scan."""
        return self.rivals.log_odds(pair, self.power(pair), self.stake[pair])

    def first_log_odds(self, pair: Pair) -> float:
        """The same to first order."""
        return self.rivals.log_odds(pair, self.first[pair], self.stake[pair])

    def worst(self) -> Pair:
        """The pair that the scan separates least."""
        return min(self.first, key=self.log_odds)

    def least_log_odds(self) -> float:
        """Of the worst pair."""
        return self.log_odds(self.worst())

    def least_first_log_odds(self) -> float:
        """Of the pair that is the worst to first order."""
        return min(self.first_log_odds(pair) for pair in self.first)

    def check(self) -> None:
        """Joint refits of the pairs that may be the worst."""
        order = sorted(self.first, key=self.first_log_odds)
        least = self.first_log_odds(order[0])
        for pair in order[: THRESHOLDS.refitted_pairs]:
            near = THRESHOLDS.near_least_odds * least + THRESHOLDS.near_least_log_odds
            if self.first_log_odds(pair) <= near and pair not in self.checked:
                i, j = pair
                first, rival = (self.first[pair], self.steps[pair]), self.rivals.rivals[j]
                power = refit_rival(self.batch, self.k, self.predictions[i], rival, first)
                self.checked[pair] = power

    def refit_ratio(self) -> float:
        """Refitted log odds over those of first order, for the worst."""
        least = self.least_first_log_odds()
        return self.least_log_odds() / least if least > 0 else 1.0


def rate_scans(
    found: list[Candidate], rivals: RivalSet, whitener: Whitener, runs: int
) -> list[RatedScan]:
    """First-order powers of all candidates, in batches of as many rows as the recording has.

    Arrays of the recording's own shape meet code that is compiled already. Steps, whose rows are
    long and whose plays start anywhere, go one by one.
    """
    size = min(runs, THRESHOLDS.batch)
    rated = []
    for together, group in (
        (size, [c for c in found if c.drive.repeats]),
        (1, [c for c in found if not c.drive.repeats]),
    ):
        for at in range(0, len(group), together):
            scans = group[at : at + together]
            padded = scans + [scans[-1]] * (together - len(scans))
            batch = ScanBatch.of([c.drive for c in padded], whitener)
            every = {id(rival): rival for rival in (*rivals.rivals, *rivals.simpler)}
            predictions = {key: batch.predict(rival) for key, rival in every.items()}
            predicted, simpler = (
                [predictions[id(rival)] for rival in some]
                for some in (rivals.rivals, rivals.simpler)
            )
            for k, candidate in enumerate(scans):
                own, other = ([p[k] for p in some] for some in (predicted, simpler))
                rated.append(_rate_scan(candidate, batch, k, rivals, own, other))
    return [r for r in rated if all(np.isfinite(p) for p in r.first.values())]


def _rate_scan(
    candidate: Candidate,
    batch: ScanBatch,
    k: int,
    rivals: RivalSet,
    predictions: list[ScanPrediction],
    simpler: list[ScanPrediction],
) -> RatedScan:
    first, steps, stake = {}, {}, {}
    without: dict[Pair, float] = {}  # by the true one, and the simpler one
    for pair in permutations(range(len(predictions)), 2):
        i, j = pair
        first[pair], steps[pair] = linear_discrimination(predictions[i], predictions[j])
        common = rivals.common.get(pair)
        if common is not None and (i, common) not in without:
            without[i, common], _ = linear_discrimination(predictions[i], simpler[common])
        stake[pair] = 0.0 if common is None else without[i, common]
    return RatedScan(candidate, batch, k, rivals, predictions, first, steps, stake)
