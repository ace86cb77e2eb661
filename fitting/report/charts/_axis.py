"""Axes of a chart: a range, its ticks, and where a value lies, in percent of the chart."""

import dataclasses
import math
from collections.abc import Iterable, Sequence

from fitting.report.diagnosis._numbers import format_setting

Values = Iterable[float | None]


@dataclasses.dataclass(frozen=True)
class Axis:
    """A range from `low` to `high`, linear or logarithmic; `ticks` are values and their text."""

    title: str
    low: float
    high: float
    ticks: Sequence[tuple[float, str]] = ()
    log: bool = False

    def place(self, value: float | None) -> float | None:
        """Percent of the way from `low` to `high`; None where the axis has no such place."""
        if value is None or not math.isfinite(value) or (self.log and value <= 0):
            return None
        low, high = self.low, self.high
        if self.log:
            low, high, value = math.log10(low), math.log10(high), math.log10(value)
        return 100.0 * (value - low) / (high - low)

    @property
    def places(self) -> list[tuple[float, str]]:
        """Ticks as percent and text."""
        found = ((self.place(value), text) for value, text in self.ticks)
        return [(at, text) for at, text in found if at is not None and -0.01 <= at <= 100.01]

    @property
    def characters(self) -> int:
        """Of the longest tick."""
        return max((len(text) for _, text in self.ticks), default=0)


def make_axis(
    title: str,
    values: Values,
    *,
    margin: float = 0.02,
    zero: bool = False,
    ends: tuple[float, float] | None = None,
    ticks: Sequence[float] = (),
) -> Axis:
    """A linear axis over `values`, or from one of `ends` to the other, with `ticks` or about five.

    `margin`: room beyond the values, as a part of their range; `zero`: whether 0 is on it.
    """
    known = [v for v in values if v is not None and math.isfinite(v)] + ([0.0] if zero else [])
    low, high = ends or (min(known, default=0.0), max(known, default=1.0))
    if ends is None:
        room = margin * (high - low) or abs(low) or 1.0
        low, high = low - room, high + room
    shown = ticks or round_values(low, high, 5)
    return Axis(title, low, high, [(v, write_tick(v)) for v in shown])


def make_log_axis(title: str, values: Values) -> Axis:
    """A logarithmic axis over the positive of `values`, with ticks at 1, 2 and 5 of a decade."""
    known = [v for v in values if v is not None and math.isfinite(v) and v > 0]
    low, high = min(known, default=1.0), max(known, default=10.0)
    if low == high:
        low, high = low / 2.0, 2.0 * high
    decades = math.log10(high / low)
    steps = (1, 2, 5) if decades < 2.5 else (1,)
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    ticks = [m * 10.0**k for k in powers for m in steps]
    return Axis(title, low, high, [(v, write_tick(v)) for v in ticks], log=True)


def round_values(low: float, high: float, count: int) -> list[float]:
    """About `count` multiples of 1, 2 or 5 times a power of ten, from `low` to `high`."""
    raw = (high - low) / count
    power = 10.0 ** math.floor(math.log10(raw))
    steps = [m * power for m in (0.5, 1, 2, 5, 10)]
    at = next(k for k, step in enumerate(steps) if k and step >= raw * (1 - 1e-9))
    # Where the whole axis lies between two multiples, those of the next smaller step.
    for step in (steps[at], steps[at - 1]):
        first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
        if first <= last:
            break
    return [k * step for k in range(first, last + 1)]


def write_tick(value: float) -> str:
    """A tick's number without trailing zeros."""
    return format_setting(0.0 if abs(value) < 1e-300 else value, "")
