"""Candidate scans with their power: to first order for all, by joint refits for the leaders."""

import dataclasses
from itertools import permutations

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener

from ._candidates import Candidate
from ._discrimination import linear_discrimination
from ._rival_refit import refit_rival
from ._scan_batch import Rival, ScanBatch, ScanPrediction
from ._thresholds import THRESHOLDS

Pair = tuple[int, int]  # which is true, and which is refitted


@dataclasses.dataclass(eq=False)
class RatedScan:
    """One candidate: powers of its ordered pairs, to first order and by refits."""

    candidate: Candidate
    batch: ScanBatch
    k: int
    predictions: list[ScanPrediction]
    first: dict[Pair, float]
    steps: dict[Pair, np.ndarray]
    checked: dict[Pair, float] = dataclasses.field(default_factory=dict)

    def least_power(self) -> float:
        """Of all pairs, the refitted power where there is one."""
        return min(self.checked.get(pair, power) for pair, power in self.first.items())

    def check(self, rivals: list[Rival]) -> None:
        """Joint refits of the pairs that may be the worst."""
        order = sorted(self.first, key=lambda pair: self.first[pair])
        least = self.first[order[0]]
        for pair in order[: THRESHOLDS.refitted_pairs]:
            if (
                self.first[pair] <= THRESHOLDS.near_least_power * least + 1.0
                and pair not in self.checked
            ):
                i, j = pair
                first = self.first[pair], self.steps[pair]
                power = refit_rival(self.batch, self.k, self.predictions[i], rivals[j], first)
                self.checked[pair] = power

    def refit_ratio(self) -> float:
        """Refitted power over that of first order, for the worst."""
        least = min(self.first.values())
        return self.least_power() / least if least > 0 else 1.0


def rate_scans(
    found: list[Candidate], rivals: list[Rival], whitener: Whitener, runs: int
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
            predictions = [batch.predict(rival) for rival in rivals]
            for k, candidate in enumerate(scans):
                rated.append(_rate_scan(candidate, batch, k, [p[k] for p in predictions]))
    return [r for r in rated if all(np.isfinite(p) for p in r.first.values())]


def _rate_scan(
    candidate: Candidate, batch: ScanBatch, k: int, predictions: list[ScanPrediction]
) -> RatedScan:
    first, steps = {}, {}
    for i, j in permutations(range(len(predictions)), 2):
        first[i, j], steps[i, j] = linear_discrimination(predictions[i], predictions[j])
    return RatedScan(candidate, batch, k, predictions, first, steps)
