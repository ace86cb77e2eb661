"""What it would take to separate hypotheses that no scan within the limits separates.

Each limit is doubled by itself, and the best scan found again, to first order. More periods of the
scan that is best within the limits help at most in proportion: the chi-square of its readings grows
so, while what the rival's parameters cost on the old data does not.
"""

import dataclasses
from collections.abc import Callable, Iterator

import numpy as np

from rapi_jax import DriveLimits

from ._rated_scan import RatedScan
from ._thresholds import THRESHOLDS

Rate = Callable[[DriveLimits], list[RatedScan]]  # all scans within limits, to first order


@dataclasses.dataclass(frozen=True)
class Remedy:
    """One limit doubled: which, in words, and the power to first order of the best scan then."""

    words: str
    power: float


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


def best_remedy(limits: DriveLimits, rate: Rate, power: float) -> Remedy | None:
    """The limit that helps most, doubled; `None` where none adds half to `power`."""
    found = []
    for words, wider in doubled_limits(limits):
        rated = rate(wider)
        if rated:
            found.append(Remedy(words, max(min(r.first.values()) for r in rated)))
    best = max(found, key=lambda remedy: remedy.power, default=None)
    return None if best is None or best.power < THRESHOLDS.worth_wider * power else best


def describe_needs(power: float, periods: int, remedy: Remedy | None) -> str:
    """What separates where `power` does not, of a scan with so many `periods`, as a clause."""
    needs = []
    if remedy is not None:
        sigmas = float(np.sqrt(remedy.power))
        needs.append(f"{remedy.words} would make it some {sigmas:.2g}")
    more = THRESHOLDS.separated_power / power if power > 0 else np.inf
    if more * periods <= THRESHOLDS.most_periods:
        needs.append(f"{int(np.ceil(more * periods))} periods in place of {periods} are the least")
    return "; ".join(needs) or "neither twice the limits nor thousands of periods separate them"
