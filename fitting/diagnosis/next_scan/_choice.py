"""The choice of the next scan: the one that best discriminates between the hypotheses.

Of all scans within the limits, the one after which the wrong one of the worst pair of hypotheses is
least probable, whichever of the two is true (see `RivalSet`). All are compared to first order; the
leaders by joint refits. Near ties go to Buzzi-Ferraris's ratio, which counts how uncertain both
predictions are. (G. Buzzi Ferraris and P. Forzatti, Chem. Eng. Sci. 38, 225, 1983.)
"""

import numpy as np

from fitting.diagnosis.noise._whitening import Whitener
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from rapi_jax import DriveLimits, Identified, Recording
from rapi_jax.internal import float64

from ._candidates import candidate_scans
from ._discrimination import buzzi_ferraris_ratio
from ._next_scan import NextScan, next_scan_of
from ._rated_scan import RatedScan, rate_scans
from ._rival_set import RivalSet
from ._thresholds import THRESHOLDS
from ._wider_limits import best_remedy, describe_needs


@float64
def choose_next_scan(
    whitened: WhitenedModel,
    whitener: Whitener,
    rivals: RivalSet,
    limits: DriveLimits | None = None,
    *,
    samples: int | None = None,
    periods: int | None = None,
) -> NextScan | None:
    """The scan that best separates `rivals`; `None` for fewer than two, or if none is allowed.

    `limits`: by default the recording's own range and largest slope. `samples` a period and
    `periods` are by default those of the recording's middle run, so a faster scan is sampled
    faster: give fewer `samples` where the reading cannot keep up. A minute passes before the scan,
    its zero is its own, and a scan that repeats has been on for a while.
    """
    if len(rivals.rivals) < 2:
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
    order, odds = _rank(rated)
    best = _break_tie(order, odds, rivals)
    order.insert(0, order.pop(order.index(best)))
    needs, least = "", best.least_log_odds()
    if least < THRESHOLDS.separated_log_odds:
        needs = describe_needs(best, periods, best_remedy(limits, rate, least))
    return next_scan_of(order, odds, recording, needs)


def scan_length(whitened: WhitenedModel) -> tuple[int, int]:
    """Samples a period, and periods, of the recording's middle run."""
    repeating = [block for block in whitened.blocks if block.repeats]
    usual = [b.left.shape[1] for b in repeating] or [max(b.size for b in whitened.blocks) // 5]
    periods = np.median([b.periods for b in repeating] or [5])
    return max(int(np.median(usual)), 16), max(int(periods), 1)


def scan_start(recording: Recording) -> float:
    """A minute after the last run, s of the session."""
    return max(float(drive.session_time[-1]) for drive in recording.drives) + THRESHOLDS.pause


def _rank(rated: list[RatedScan]) -> tuple[list[RatedScan], dict[int, float]]:
    """Candidates best first, and the log odds of each against the wrong one, by its `id`.

    The most promising is refitted, again and again, until none that could lead is left.
    """

    def estimates() -> dict[int, float]:
        done = [r.refit_ratio() for r in rated if r.checked]
        scale = float(np.median(done)) if done else 1.0
        return {
            id(r): r.least_log_odds() if r.checked else scale * r.least_first_log_odds()
            for r in rated
        }

    for done in range(min(THRESHOLDS.most_refitted, len(rated))):
        odds = estimates()
        leader = max(odds.values())
        waiting = max((r for r in rated if not r.checked), key=lambda r: odds[id(r)])
        if done >= THRESHOLDS.least_refitted and odds[id(waiting)] < THRESHOLDS.tie * leader:
            break
        waiting.check()
    odds = estimates()
    best = max(odds[id(r)] for r in rated if r.checked)
    for r in rated:
        if not r.checked:
            odds[id(r)] = min(odds[id(r)], best)  # an estimate does not outrank a refit
    order = sorted(rated, key=lambda r: (-odds[id(r)], not r.checked))
    return order, odds


def _break_tie(order: list[RatedScan], odds: dict[int, float], rivals: RivalSet) -> RatedScan:
    """Of the refitted ones next to the best, the one with the largest ratios over all pairs.

    Their logarithms are averaged, pairs of likely hypotheses counting more.
    """
    done = [r for r in order if r.checked]
    near = [r for r in done if odds[id(r)] >= THRESHOLDS.tie * odds[id(done[0])]]
    if len(near) == 1:
        return near[0]
    chances = rivals.probability

    def mean_log_ratio(r: RatedScan) -> float:
        pairs = [(i, j) for i, j in r.first if i < j]
        weights = [max(chances[i] * chances[j], 1e-12) for i, j in pairs]
        ratios = [np.log1p(max(_ratio(r, i, j), 0.0)) for i, j in pairs]
        return float(np.average(ratios, weights=weights))

    return max(near, key=mean_log_ratio)


def _ratio(scan: RatedScan, i: int, j: int) -> float:
    return buzzi_ferraris_ratio(scan.predictions[i], scan.predictions[j])
