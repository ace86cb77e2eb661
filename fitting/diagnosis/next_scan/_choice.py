"""The choice of the next scan: the one that best discriminates between the hypotheses.

Of all scans within the limits, the one whose worst pair of hypotheses is separated best (see
`_discrimination`), whichever of the two is true. All are compared to first order; the leaders by
joint refits. Near ties go to Buzzi-Ferraris's ratio, which counts how uncertain both predictions
are. (G. Buzzi Ferraris and P. Forzatti, Chem. Eng. Sci. 38, 225, 1983.)
"""

import dataclasses
from collections.abc import Sequence

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._base_model import BaseModel
from fitting.diagnosis.refit._gauss_newton import Refit
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import DriveLimits, Identified, Recording
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import float64

from ._candidates import candidate_scans
from ._discrimination import buzzi_ferraris_ratio
from ._next_scan import NextScan, next_scan_of
from ._rated_scan import RatedScan, rate_scans
from ._scan_batch import Rival
from ._thresholds import THRESHOLDS
from ._wider_limits import best_remedy, describe_needs

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

    `limits`: by default the recording's own range and largest slope. `samples` a period and
    `periods` are by default those of the recording's middle run, so a faster scan is sampled
    faster: give fewer `samples` where the reading cannot keep up. A minute passes before the scan,
    its zero is its own, and a scan that repeats has been on for a while.
    """
    rivals, chances = _rivals(whitened, whitener, base, hypotheses)
    if len(rivals) < 2:
        return None
    usual = scan_length(whitened)
    samples, periods = samples or usual[0], periods or usual[1]
    recording = whitened.recording
    limits = Identified.of(recording).recorded_limits() if limits is None else limits
    start = scan_start(recording)

    def rate(limits: DriveLimits) -> list[RatedScan]:
        found = candidate_scans(recording, limits, samples=samples, periods=periods, start_s=start)
        return rate_scans(found, rivals, whitener, len(whitened.blocks))

    rated = rate(limits)
    if not rated:
        return None
    order, powers = _rank(rated, rivals)
    best = _break_tie(order, powers, chances)
    order.insert(0, order.pop(order.index(best)))
    needs, power = "", powers[id(best)]
    if power < THRESHOLDS.separated_power:
        needs = describe_needs(power, periods, best_remedy(limits, rate, power))
    return next_scan_of(order, powers, rivals, recording.drive_unit, needs)


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


def _rank(rated: list[RatedScan], rivals: list[Rival]) -> tuple[list[RatedScan], dict[int, float]]:
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


def _break_tie(order: list[RatedScan], powers: dict[int, float], chances: list[float]) -> RatedScan:
    """Of the refitted ones next to the best, the one with the largest ratios over all pairs.

    Their logarithms are averaged, pairs of likely hypotheses counting more.
    """
    done = [r for r in order if r.checked]
    near = [r for r in done if powers[id(r)] >= THRESHOLDS.tie * powers[id(done[0])]]
    if len(near) == 1:
        return near[0]

    def mean_log_ratio(r: RatedScan) -> float:
        pairs = [(i, j) for i, j in r.first if i < j]
        weights = [max(chances[i] * chances[j], 1e-12) for i, j in pairs]
        ratios = [np.log1p(max(_ratio(r, i, j), 0.0)) for i, j in pairs]
        return float(np.average(ratios, weights=weights))

    return max(near, key=mean_log_ratio)


def _ratio(scan: RatedScan, i: int, j: int) -> float:
    return buzzi_ferraris_ratio(scan.predictions[i], scan.predictions[j])
