"""The choice of the next scan: the one that best discriminates between the hypotheses.

Of all scans within the limits, the one whose worst pair of hypotheses is separated best (see
`_discrimination`), whichever of the two is true. All are compared to first order; the leaders by
joint refits. Near ties go to Buzzi-Ferraris's ratio, which counts how uncertain both predictions
are. (G. Buzzi Ferraris and P. Forzatti, Chem. Eng. Sci. 38, 225, 1983.)
"""

import dataclasses
from collections.abc import Sequence
from itertools import permutations
from typing import Any

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import Drive, DriveLimits, Identified, Recording
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import float64

from ._candidates import Candidate, candidate_scans
from ._discrimination import Rival, ScanBatch, ScanPrediction, linear_discrimination, ratio
from ._rival_refit import refit_rival
from ._thresholds import THRESHOLDS

_LISTED = 20  # candidates in the report
_WITHOUT_PREDICTION = ("unlisted",)  # it predicts nothing, so no scan is planned for it

Pair = tuple[int, int]  # which is true, and which is refitted


@dataclasses.dataclass(frozen=True, eq=False)
class Hypothesis:
    """Effects that may be at work, with all parameters as fitted to the data.

    `values`: see `WhitenedModel.operator_response`; with initial states of the old runs.
    """

    name: str
    effects: tuple[AbstractEffect, ...]
    values: np.ndarray
    probability: float


@dataclasses.dataclass(frozen=True, eq=False)
class NextScan:
    """A scan, what it separates, and what else was considered.

    `power`: chi-square that the wrong one of the worst pair would lose, at least. `separates`: the
    hypotheses of all pairs with a power of 9 or more. `pairs`: for each ordered pair the true one,
    the `rival`, the `power`, and whether a joint refit gave it (`checked`). `candidates`: best
    first; powers of scans that were not refitted are first-order ones, scaled as those that were.
    `drive`: to play.
    """

    waveform: str
    excitation_hz: float | None
    amplitude: float
    bias: float
    separates: list[str]
    power: float
    pairs: list[dict[str, Any]]
    candidates: list[dict[str, Any]]
    reason: str
    drive: Drive

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, for `diagnosis.json`; without the drive."""
        names = [f.name for f in dataclasses.fields(self) if f.name != "drive"]
        return {**self.candidates[0], **{name: getattr(self, name) for name in names}}


@dataclasses.dataclass(eq=False)
class _Rated:
    """One candidate: powers of its ordered pairs, to first order and by refits."""

    candidate: Candidate
    trials: ScanBatch
    k: int
    seen: list[ScanPrediction]
    first: dict[Pair, float]
    moves: dict[Pair, np.ndarray]
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
                first = self.first[pair], self.moves[pair]
                power = refit_rival(self.trials, self.k, self.seen[i], rivals[j], first)
                self.checked[pair] = power

    def refit_ratio(self) -> float:
        """Refitted power over that of first order, for the worst."""
        least = min(self.first.values())
        return self.least_power() / least if least > 0 else 1.0


@float64
def choose_next_scan(
    whitened: WhitenedModel,
    whitener: Whitener,
    base: BaseModel,
    hypotheses: Sequence[Hypothesis],
    limits: DriveLimits | None = None,
    *,
    samples: int | None = None,
    periods: int | None = None,
) -> NextScan | None:
    """The scan that best separates `hypotheses`; `None` for fewer than two, or if none is allowed.

    `limits`: by default the recording's own range, 5 % more swing and 3 times the slope. `samples`
    a period and `periods` are by default those of the recording's middle run, so a faster scan is
    sampled faster: give fewer `samples` where the reading cannot keep up. A minute passes before
    the scan, its zero is its own, and a scan that repeats has been on for a while.
    """
    rivals, chances = _rivals(whitened, whitener, base, hypotheses)
    if len(rivals) < 2:
        return None
    usual = scan_length(whitened)
    samples, periods = samples or usual[0], periods or usual[1]
    recording = whitened.recording
    limits = Identified.of(recording).limits() if limits is None else limits
    start = scan_start(recording)
    found = candidate_scans(recording, limits, samples=samples, periods=periods, start_s=start)
    rated = _rate(found, rivals, whitener, len(whitened.blocks))
    if not rated:
        return None
    order, powers = _rank(rated, rivals)
    best = _break_tie(order, powers, chances)
    order.insert(0, order.pop(order.index(best)))
    return _next_scan(order, powers, rivals, recording.drive_unit)


def scan_length(whitened: WhitenedModel) -> tuple[int, int]:
    """Samples a period, and periods, of the recording's middle run."""
    repeating = [block for block in whitened.blocks if block.repeats]
    usual = [b.left.shape[1] for b in repeating] or [max(b.size for b in whitened.blocks) // 5]
    periods = np.median([b.periods for b in repeating] or [5])
    return max(int(np.median(usual)), 16), max(int(periods), 1)


def scan_start(recording: Recording) -> float:
    """A minute after the last run, s of the session."""
    return max(float(drive.session_time[-1]) for drive in recording.drives) + THRESHOLDS.pause


def _rivals(
    whitened: WhitenedModel, whitener: Whitener, base: BaseModel, hypotheses: Sequence[Hypothesis]
) -> tuple[list[Rival], list[float]]:
    refit = Refit(whitened, whitener, base)
    predicting = [h for h in hypotheses if h.name not in _WITHOUT_PREDICTION]
    rivals = [Rival.of(refit, h.name, h.values, h.effects) for h in predicting]
    return rivals, [h.probability for h in predicting]


def _rate(
    found: list[Candidate], rivals: list[Rival], whitener: Whitener, runs: int
) -> list[_Rated]:
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
            batch = group[at : at + together]
            padded = batch + [batch[-1]] * (together - len(batch))
            trials = ScanBatch.of([c.drive for c in padded], whitener)
            seen = [trials.see(rival) for rival in rivals]
            for k, candidate in enumerate(batch):
                rated.append(_rate_one(candidate, trials, k, [s[k] for s in seen]))
    return [r for r in rated if all(np.isfinite(p) for p in r.first.values())]


def _rate_one(
    candidate: Candidate, trials: ScanBatch, k: int, seen: list[ScanPrediction]
) -> _Rated:
    first, moves = {}, {}
    for i, j in permutations(range(len(seen)), 2):
        first[i, j], moves[i, j] = linear_discrimination(seen[i], seen[j])
    return _Rated(candidate, trials, k, seen, first, moves)


def _rank(rated: list[_Rated], rivals: list[Rival]) -> tuple[list[_Rated], dict[int, float]]:
    """Candidates best first, and the power of each by its `id`.

    The most promising is refitted, again and again, until none that could lead is left.
    """

    def estimates() -> dict[int, float]:
        done = [r.refit_ratio() for r in rated if r.checked]
        scale = float(np.median(done)) if done else 1.0
        return {
            id(r): r.least_power() if r.checked else scale * min(r.first.values()) for r in rated
        }

    for done in range(min(THRESHOLDS.most_refitted, len(rated))):
        powers = estimates()
        leader = max(powers.values())
        waiting = max((r for r in rated if not r.checked), key=lambda r: powers[id(r)])
        if done >= THRESHOLDS.least_refitted and powers[id(waiting)] < THRESHOLDS.tie * leader:
            break
        waiting.check(rivals)
    powers = estimates()
    best = max(powers[id(r)] for r in rated if r.checked)
    for r in rated:
        if not r.checked:
            powers[id(r)] = min(powers[id(r)], best)  # an estimate does not outrank a refit
    order = sorted(rated, key=lambda r: (-powers[id(r)], not r.checked))
    return order, powers


def _break_tie(order: list[_Rated], powers: dict[int, float], chances: list[float]) -> _Rated:
    """Of the refitted ones next to the best, the one with the largest ratios over all pairs.

    Their logarithms are averaged, pairs of likely hypotheses counting more.
    """
    done = [r for r in order if r.checked]
    near = [r for r in done if powers[id(r)] >= THRESHOLDS.tie * powers[id(done[0])]]
    if len(near) == 1:
        return near[0]

    def mean_log_ratio(r: _Rated) -> float:
        pairs = [(i, j) for i, j in r.first if i < j]
        weights = [max(chances[i] * chances[j], 1e-12) for i, j in pairs]
        ratios = [np.log1p(max(ratio(r.seen[i], r.seen[j]), 0.0)) for i, j in pairs]
        return float(np.average(ratios, weights=weights))

    return max(near, key=mean_log_ratio)


def _next_scan(
    order: list[_Rated], powers: dict[int, float], rivals: list[Rival], unit: str
) -> NextScan:
    best, names = order[0], [rival.name for rival in rivals]
    table = [
        {
            "true": names[i],
            "rival": names[j],
            "power": best.checked.get((i, j), power),
            "checked": (i, j) in best.checked,
        }
        for (i, j), power in sorted(best.first.items())
    ]
    both = {
        (i, j): min(best.checked.get(p, best.first[p]) for p in ((i, j), (j, i)))
        for i, j in best.first
        if i < j
    }
    apart = {i for pair, power in both.items() if power >= THRESHOLDS.separated_power for i in pair}
    listed = [
        {**r.candidate.to_dict(), "power": powers[id(r)], "checked": bool(r.checked)}
        for r in order[:_LISTED]
    ]
    c = best.candidate
    return NextScan(
        waveform=c.waveform,
        excitation_hz=c.excitation_hz,
        amplitude=c.amplitude,
        bias=c.bias,
        separates=[names[i] for i in sorted(apart)],
        power=powers[id(best)],
        pairs=table,
        candidates=listed,
        reason=_reason(c, min(both, key=lambda p: both[p]), powers[id(best)], names, unit),
        drive=c.drive,
    )


def _reason(candidate: Candidate, pair: Pair, power: float, names: list[str], unit: str) -> str:
    one, other = (names[i].replace("_", " ") for i in pair)
    scan, sigmas = candidate.describe(unit), float(np.sqrt(power))
    if power >= THRESHOLDS.separated_power:
        return (
            f"{scan} tells {one} from {other}, the hardest pair, best: the wrong one would "
            f"miss it by {sigmas:.3g} standard deviations even after a refit."
        )
    return (
        f"{scan} is the best there is within the limits, but {one} and {other} would still "
        f"differ by only {sigmas:.2g} standard deviations: wider limits or more periods are needed."
    )
