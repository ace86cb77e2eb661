"""What it would take to separate hypotheses that no scan within the limits separates.

Each limit is doubled by itself, and the best scan found again, to first order. More periods of the
scan that is best within the limits help at most as `RivalSet.repeats_needed` says: the chi-square
of its readings grows in proportion, what the rival's parameters cost on the old data does not.
"""

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np

from rapi_jax import DriveLimits

from ._next_scan import describe_probability
from ._rated_scan import RatedScan
from ._rival_set import probability_left
from ._thresholds import THRESHOLDS

Rate = Callable[[DriveLimits], list[RatedScan]]  # all scans within limits, to first order


@dataclasses.dataclass(frozen=True)
class Remedy:
    """One limit doubled: which, in words, and to first order the log odds of the best scan then."""

    words: str
    log_odds: float


def doubled_limits(limits: DriveLimits) -> Iterator[tuple[str, DriveLimits]]:
    """The limits with one of them doubled, and that one in words; infinite ones are left."""
    u, factor = limits.unit, THRESHOLDS.wider
    middle, half = (limits.low_v + limits.high_v) / 2.0, (limits.high_v - limits.low_v) / 2.0
    low, high = middle - factor * half, middle + factor * half
    yield (
        f"a range from {low:.3g} to {high:.3g} {u}",
        dataclasses.replace(limits, low_v=low, high_v=high),
    )
    for field, unit in (("slew_v_per_s", f"{u}/s"), ("step_v", u), ("max_frequency_hz", "Hz")):
        value = getattr(limits, field)
        if np.isfinite(value):
            name = {"slew_v_per_s": "slopes", "step_v": "steps", "max_frequency_hz": "scan rates"}
            yield (
                f"{name[field]} up to {factor * value:.3g} {unit}",
                dataclasses.replace(limits, **{field: factor * value}),
            )


def best_remedy(limits: DriveLimits, rate: Rate, least: float) -> Remedy | None:
    """The limit that helps most, doubled; `None` where none adds half to the log odds `least`."""
    found = []
    for words, wider in doubled_limits(limits):
        rated = rate(wider)
        if rated:
            found.append(Remedy(words, max(r.least_first_log_odds() for r in rated)))
    best = max(found, key=lambda remedy: remedy.log_odds, default=None)
    return None if best is None or best.log_odds < THRESHOLDS.worth_wider * least else best


def describe_needs(best: RatedScan, periods: int, remedy: Remedy | None) -> str:
    """What separates where `best` does not, a scan with so many `periods`, as a clause."""
    needs = []
    if remedy is not None:
        left = describe_probability(probability_left(remedy.log_odds))
        needs.append(f"with {remedy.words} the wrong hypothesis would keep {left}")
    repeats = max(
        best.rivals.repeats_needed(pair, best.power(pair), best.stake[pair]) for pair in best.first
    )
    if repeats * periods <= THRESHOLDS.most_periods:
        count = int(np.ceil(repeats * periods))
        needs.append(f"at least {count} periods in place of {periods} would separate them")
    elif not np.isfinite(repeats):
        needs.append("more periods would not separate them")
    text = "; ".join(needs) or "neither twice the limits nor thousands of periods separate them"
    return text[0].upper() + text[1:]
