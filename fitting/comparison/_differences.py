"""What differs between two recordings, one by one: parameters, effects, the gap."""

import dataclasses
from typing import Any

from ._thresholds import THRESHOLDS


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

    @property
    def relative(self) -> bool:
        """Whether it is far enough from 0 for a change in per cent."""
        return abs(self.before) > THRESHOLDS.known_relative * self.before_stderr

    def describe(self, amount: Interval) -> str:
        """An amount in its unit with interval, and in per cent where that has a meaning."""
        unit = "" if self.unit == "1" else f" {self.unit}"
        text = f"{amount.value:+.3g}{unit} ({amount.low:+.3g} to {amount.high:+.3g})"
        if self.relative:
            text += f", {100.0 * amount.value / abs(self.before):+.2g} %"
        return text

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
