"""What differs between two recordings, one by one: parameters, effects, the gap."""

import dataclasses
import math
import re
from typing import Any

from fitting._units import significant

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
    def relative(self) -> bool:
        """Whether it is far enough from 0 for a change in per cent."""
        return abs(self.before) > THRESHOLDS.known_relative * self.before_stderr

    def describe(self, amount: Interval) -> str:
        """An amount in its unit with interval, and in per cent where that has a meaning."""
        text = _signed(f"{amount.value:+.3g}{self._unit} ({amount.low:+.3g} to {amount.high:+.3g})")
        return f"{text}, {self._share(amount)}" if self.relative else text

    def describe_share(self) -> str:
        """The difference in per cent, or in its unit where that has no meaning."""
        if self.relative:
            return self._share(self.difference)
        return _signed(f"{self.difference.value:+.3g}{self._unit}")

    def describe_percent(self, amount: Interval) -> str:
        """An amount with interval in per cent; in its unit where that has no meaning."""
        scale = 100.0 / abs(self.before) if self.before else math.inf
        ends = [scale * x for x in (amount.value, amount.low, amount.high)]
        far = max(abs(x) for x in ends) >= _MOST_PERCENT or abs(ends[0]) < _LEAST_PERCENT
        if not self.relative or far:
            return self.describe(amount)
        spread = max(0.5 * (ends[2] - ends[1]), 10.0**-_MOST_DECIMALS)
        decimals = max(0, -math.floor(math.log10(spread)))
        value, low, high = (f"{x:+.{decimals}f}" for x in ends)
        return _signed(f"{value} % ({low} to {high})")

    @property
    def _unit(self) -> str:
        return "" if self.unit == "1" else f" {self.unit}"

    def _share(self, amount: Interval) -> str:
        """In per cent with two digits, or three before the point; no power of ten."""
        share = 100.0 * amount.value / abs(self.before)
        if abs(share) >= _MOST_PERCENT:
            return f"by over {_MOST_PERCENT:.0f} %"
        if abs(share) < _LEAST_PERCENT:
            return f"by under {_LEAST_PERCENT:g} %"
        return _signed(f"{'+' if share > 0 else ''}{significant(share, 2)} %")

    def to_dict(self) -> dict[str, Any]:
        """The fields as in `comparison.json`."""
        fields = dataclasses.asdict(self)
        share = 100.0 * self.difference.value / abs(self.before) if self.relative else None
        return {k: v for k, v in fields.items() if k != "name"} | {"percent": share}


@dataclasses.dataclass(frozen=True)
class EffectPresence:
    """One effect named by a diagnosis of either recording, and how probable it is in each."""

    effect: str
    label: str
    before: bool
    after: bool
    before_probability: float
    after_probability: float

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
