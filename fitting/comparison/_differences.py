"""What differs between two recordings, one by one: parameters, effects, the gap."""

import dataclasses
import math
import re
from typing import Any

from fitting.report.comparison._sizes import format_range
from fitting.report.diagnosis._numbers import SPACE, Scale, format_number

from ._thresholds import THRESHOLDS

_MOST_PERCENT, _LEAST_PERCENT = 990.0, 0.01  # of a change, between which it is told
_MOST_DECIMALS = 3  # of a change in per cent


@dataclasses.dataclass(frozen=True)
class Interval:
    """A number with the ends of its 95 % interval."""

    value: float
    low: float
    high: float


@dataclasses.dataclass(frozen=True)
class ParameterDifference:
    """One parameter in both recordings, in `unit`; `words`: what it is called.

    - `difference`: after less before; `p_value`: of it by itself, `p_holm`: for all parameters
      together.
    - `change`: the same if no other parameter changed; `p_given_others` of it.
    - `probability`: that this parameter changed, and it alone.
    - `detectable`: the change, if no other parameter changed, that such recordings show in 95 % of
      cases.
    """

    name: str
    words: str
    unit: str
    before: float
    before_stderr: float
    after: float
    after_stderr: float
    difference: Interval
    difference_stderr: float
    p_value: float
    p_holm: float
    change: Interval
    change_stderr: float
    p_given_others: float
    p_given_others_holm: float
    probability: float
    detectable: float

    @property
    def of_effect(self) -> bool:
        """Whether it is a parameter of an effect, not of the operator."""
        return "." in self.name

    @property
    def relative(self) -> bool:
        """Whether it is far enough from 0 for a change in per cent."""
        return abs(self.before) > THRESHOLDS.known_relative * self.before_stderr

    def describe(self, amount: Interval) -> str:
        """An amount in its unit with interval, and in per cent where that has a meaning.

        Per cent are of the value before, with its sign: what grows away from 0 grows by so much.
        """
        text = format_range(dataclasses.asdict(amount), self.unit).replace(SPACE, " ")
        return f"{text}, {self._share(amount)}" if self.relative else text

    def describe_share(self) -> str:
        """The difference in per cent, or in its unit where that has no meaning."""
        if self.relative:
            return self._share(self.difference)
        scale = Scale.of(self.unit, [self.difference.value])
        return scale(self.difference.value, sign=True).replace(SPACE, " ")

    def describe_percent(self, amount: Interval) -> str:
        """An amount with interval in per cent; in its unit where that has no meaning."""
        scale = 100.0 / self.before if self.before else math.inf
        value, *edges = (scale * x for x in (amount.value, amount.low, amount.high))
        ends = [value, *sorted(edges)]
        far = max(abs(x) for x in ends) >= _MOST_PERCENT or abs(ends[0]) < _LEAST_PERCENT
        if not self.relative or far:
            return self.describe(amount)
        spread = max(0.5 * (ends[2] - ends[1]), 10.0**-_MOST_DECIMALS)
        decimals = max(0, -math.floor(math.log10(spread)))
        value, low, high = (f"{x:+.{decimals}f}" for x in ends)
        return _signed(f"{value} % ({low} to {high})")

    def _share(self, amount: Interval) -> str:
        """In per cent with two digits, or three before the point; no power of ten."""
        share = 100.0 * amount.value / self.before
        if abs(share) >= _MOST_PERCENT:
            return f"by over {_MOST_PERCENT:.0f} %"
        if abs(share) < _LEAST_PERCENT:
            return f"by under {_LEAST_PERCENT:g} %"
        return f"{format_number(share, 2, sign=True)} %"

    def to_dict(self) -> dict[str, Any]:
        """The fields as in `comparison.json`."""
        fields = dataclasses.asdict(self)
        share = 100.0 * self.difference.value / self.before if self.relative else None
        return {k: v for k, v in fields.items() if k != "name"} | {"percent": share}


@dataclasses.dataclass(frozen=True)
class EffectSize:
    """One parameter of an effect that one recording alone has, in `unit`; `words`: its name.

    `interval`: its estimate there, of standard error `stderr`.
    """

    name: str
    words: str
    unit: str
    interval: Interval
    stderr: float


@dataclasses.dataclass(frozen=True)
class EffectPresence:
    """One effect named by a diagnosis of either recording, and how probable it is in each.

    `sizes`: its parameters, where one recording alone has it; those of one that both have are
    compared as all others.
    """

    effect: str
    label: str
    before: bool
    after: bool
    before_probability: float
    after_probability: float
    sizes: tuple[EffectSize, ...] = ()

    @property
    def only_in(self) -> str | None:
        """The one recording that has it; `None` where both do."""
        return None if self.before == self.after else "before" if self.before else "after"


@dataclasses.dataclass(frozen=True)
class GapChange:
    """The gap above noise (rms, response's unit) that one model leaves in each recording.

    `reference`: which model. `noise_floor`: rms before and after. `p_value`: of the change.
    """

    reference: str
    before: Interval
    after: Interval
    change: Interval
    noise_floor: tuple[float, float]
    p_value: float


def _signed(text: str) -> str:
    """Numbers with the sign for minus, where no power of ten has a hyphen."""
    return re.sub(r"(?<!\w)-(?=\d)", "\N{MINUS SIGN}", text)
