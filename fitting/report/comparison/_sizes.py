"""Sizes of the response in a comparison: in one unit, and with digits by one rule."""

import dataclasses
from collections.abc import Iterable, Mapping
from typing import Any

from fitting._units import interval_digits
from fitting.report.diagnosis._numbers import (
    SPACE,
    Scale,
    finite_or_none,
    format_number,
    format_percent,
)

_ENDS = ("value", "low", "high")
_MOST_DIGITS = 4  # of a size: two of its interval's width, and no more than tells it from others
_LEAST_PROBABILITY = 1e-12


@dataclasses.dataclass(frozen=True)
class Sizes:
    """The unit of a comparison, in which its largest size is at least 1."""

    scale: Scale

    @classmethod
    def of(cls, content: Mapping[str, Any]) -> "Sizes":
        """Of the dictionary of `comparison.json`."""
        intervals = [content["response_change"]]
        for key in ("gap", "misfit"):
            if content[key] is not None:
                intervals += [content[key]["before"], content[key]["after"]]
        rms = [one[key] for one in content["recordings"].values() for key in ("rmse", "rmse_joint")]
        return cls.of_sizes(content["unit"], [*(i["high"] for i in intervals), *rms])

    @classmethod
    def of_sizes(cls, unit: str, sizes: Iterable[float]) -> "Sizes":
        """Of sizes in `unit`."""
        return cls(Scale.of(unit, list(sizes)))

    def value(self, size: Any) -> str:
        """A size alone."""
        return self.scale(size)

    def interval(self, interval: Mapping[str, Any]) -> str:
        """A size with its interval: `41.3 MHz (39.1 to 43.5)`; a bound where it may be 0."""
        if not finite_or_none(interval["low"]):
            return f"at most {self.value(interval['high'])}"
        digits = self._digits(interval)
        low, high = (self.scale.bare(interval[k], digits=digits[k]) for k in ("low", "high"))
        return f"{self.scale(interval['value'], digits=digits['value'])} ({low} to {high})"

    def change(self, interval: Mapping[str, Any]) -> str:
        """A difference of sizes: `+0.05 (+0.04 to +0.06) GHz`."""
        digits = self._digits(interval)
        value, low, high = (
            self.scale.bare(interval[k], digits=digits[k], sign=True) for k in _ENDS
        )
        return f"{value} ({low} to {high}){SPACE}{self.scale.unit}"

    def _digits(self, interval: Mapping[str, Any]) -> dict[str, int]:
        digits = interval_places({k: self.scale.value(interval[k]) for k in _ENDS})
        return {key: min(number, _MOST_DIGITS) for key, number in digits.items()}


def interval_places(interval: Mapping[str, Any]) -> dict[str, int]:
    """The significant digits of the value and both ends, by the width between these."""
    ends = {key: finite_or_none(interval[key]) for key in _ENDS}
    low, high = ends["low"], ends["high"]
    width = 0.0 if low is None or high is None else high - low
    return {key: interval_digits(end or 0.0, width) for key, end in ends.items()}


def format_range(interval: Mapping[str, Any], unit: str, *, sign: bool = True) -> str:
    """`+0.05 (+0.04 to +0.06) GHz`, of a parameter."""
    scale = Scale.of(unit, [interval[key] for key in _ENDS])
    shown = {key: scale.value(interval[key]) for key in _ENDS}
    digits = interval_places(shown)
    value, low, high = (format_number(shown[k], digits[k], sign=sign) for k in _ENDS)
    end = "" if unit in ("", "1") else f"{SPACE}{scale.unit}"
    return f"{value} ({low} to {high}){end}"


def format_probability(probability: Any) -> str:
    """A probability, of which neither 0 nor 100 % can be known."""
    x = finite_or_none(probability)
    return format_percent(None if x is None else max(x, _LEAST_PROBABILITY))
