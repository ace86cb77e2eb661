"""High and low levels: rounded to the instrument's grid, and set in an order that is legal."""

import math
from collections.abc import Iterator
from typing import NamedTuple

from rapi_jax import DriveLimits, LimitError

from ._thresholds import THRESHOLDS


class Levels(NamedTuple):
    """The voltages of the lowest and the highest code, V."""

    low_v: float
    high_v: float

    @property
    def pp(self) -> float:
        """Peak to peak, V."""
        return self.high_v - self.low_v


def level_step(volts: float) -> float:
    """Step in which a level of about `volts` can be set: 0.1 mV or 4 digits, V."""
    size = abs(volts) * (1 + 1e-12)
    return 1e-4 if size < 1.0 else 10.0 ** (math.floor(math.log10(size)) - 3)


def floor_level(volts: float) -> float:
    """The next level at or below `volts`."""
    step = level_step(volts)
    return round(math.floor(volts / step + THRESHOLDS.grid_rounding) * step, 4) + 0.0  # never -0.0


def ceil_level(volts: float) -> float:
    """The next level at or above `volts`."""
    return 0.0 - floor_level(-volts)


def settable_limits(limits: DriveLimits, largest_v: float) -> DriveLimits:
    """`limits` with edges that the instrument can set; raises `LimitError` where it cannot.

    `largest_v`: what the instrument gives at the load, of either sign.
    """
    for name in ("slew_v_per_s", "step_v", "max_frequency_hz"):
        if math.isinf(getattr(limits, name)):
            raise LimitError(
                f"`{name}` has no limit, but an instrument needs one. Give what the device behind "
                "it withstands, from its data sheet."
            )
    low, high = ceil_level(limits.low_v), floor_level(limits.high_v)
    if max(-low, high) > largest_v:
        raise LimitError(
            f"The limits {low:g} V to {high:g} V go beyond what the instrument gives at this load, "
            f"{largest_v:g} V of either sign. Narrow them."
        )
    if high - low < THRESHOLDS.park_pp_v:
        raise LimitError(
            f"The limits {low:g} V to {high:g} V are less than {THRESHOLDS.park_pp_v:g} V apart, "
            "the smallest amplitude (peak to peak) that is set. Widen them."
        )
    return DriveLimits(low, high, limits.slew_v_per_s, limits.step_v, limits.max_frequency_hz)


def enclosing_levels(low_v: float, high_v: float, limits: DriveLimits) -> Levels:
    """The tightest levels that enclose `low_v` to `high_v`, rounded outward, within `limits`."""
    low = max(floor_level(low_v), limits.low_v)
    high = min(ceil_level(high_v), limits.high_v)
    if high - low < THRESHOLDS.park_pp_v:
        middle = (low + high) / 2
        low = max(floor_level(middle - THRESHOLDS.park_pp_v / 2), limits.low_v)
        high = ceil_level(low + THRESHOLDS.park_pp_v)
        if high > limits.high_v:
            high = limits.high_v
            low = floor_level(high - THRESHOLDS.park_pp_v)
    return Levels(low, high)


def park_levels(park_v: float, limits: DriveLimits) -> Levels:
    """The smallest swing at `park_v`, or as near to it as `limits` allow."""
    at = min(max(park_v, limits.low_v), limits.high_v)
    return enclosing_levels(at, at, limits)


def setting_order(now: Levels, then: Levels) -> tuple[str, str]:
    """Which level to set first, so that the pair between is legal and swings as little as it can.

    The smaller swing keeps slopes between those of `now` and `then`.
    """
    low_first, high_first = now.high_v - then.low_v, then.high_v - now.low_v
    legal = THRESHOLDS.park_pp_v / 2
    if low_first >= legal and (low_first <= high_first or high_first < legal):
        return "low", "high"
    return "high", "low"


def ramp_levels(now: Levels, then: Levels, step_v: float) -> Iterator[Levels]:
    """Levels from `now` to `then`, excluding `now`, none further than `step_v` from the one before.

    Each is a mean of the two ends, rounded to the grid: within any limits that both keep.
    """
    furthest = max(abs(then.low_v - now.low_v), abs(then.high_v - now.high_v))
    count = max(1, math.ceil(furthest / step_v - 1e-9))
    for i in range(1, count):
        share = i / count
        low = now.low_v + share * (then.low_v - now.low_v)
        high = now.high_v + share * (then.high_v - now.high_v)
        yield Levels(ceil_level(low), floor_level(high))
    if furthest > 0:
        yield then
