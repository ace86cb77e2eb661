"""The sums that probabilities are made of, as plain numbers: what a calibration is fitted to."""

import dataclasses
from typing import Any

from ._candidates import Candidate
from ._forward_selection import Attribution

# Names in files, where they differ from the fields.
_KEYS = {"synchronous": "locked", "nonsynchronous": "loose"}
_FIELDS = {key: field for field, key in _KEYS.items()}


@dataclasses.dataclass(frozen=True)
class Left:
    """What a hypothesis leaves on the richer base.

    `locked`, `loose`: chi-square of what repeats with the scan, and of what does not; `prior`: of
    the base's values, and of jumps a sample early or late. `parameters`: of the effects.
    `identified`: what it leaves on the identified base, of which nothing is known where it is
    `None`.
    """

    effects: tuple[str, ...]
    parameters: int
    synchronous: float
    nonsynchronous: float
    prior: float
    identified: float | None = None

    @property
    def name(self) -> str:
        """The effects' names in alphabetical order, joined by +; `none` where there is none."""
        return "+".join(sorted(self.effects)) or "none"

    @property
    def cost(self) -> float:
        """All of it."""
        return self.synchronous + self.nonsynchronous + self.prior


@dataclasses.dataclass(frozen=True)
class Evidence:
    """All hypotheses, `none` first; out of how many lines; whether noise was measured."""

    lines: int
    nonsynchronous_lines: int
    noise_known: bool
    hypotheses: tuple[Left, ...]

    @classmethod
    def of(cls, attribution: Attribution, *, noise_known: bool) -> "Evidence":
        """The evidence of an attribution."""
        errors = attribution.none.rich.errors
        found = (attribution.none, *attribution.candidates)
        size = (errors.synchronous.size, errors.nonsynchronous.size)
        return cls(*size, noise_known, tuple(_left(c) for c in found))

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "Evidence":
        """From what `to_dict` gave."""
        hypotheses = tuple(_from_file(h) for h in value["hypotheses"])
        return cls(value["lines"], value["loose_lines"], value["noise_known"], hypotheses)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists, under the names that files have."""
        return {
            "lines": self.lines,
            "loose_lines": self.nonsynchronous_lines,
            "noise_known": self.noise_known,
            "hypotheses": [
                {_KEYS.get(k, k): v for k, v in dataclasses.asdict(h).items()}
                for h in self.hypotheses
            ],
        }

    def excess(self, left: Left) -> float:
        """Chi-square above what noise alone would leave."""
        return left.synchronous + left.nonsynchronous - self.lines - self.nonsynchronous_lines


def _left(candidate: Candidate) -> Left:
    rich, plain = candidate.rich, candidate.plain
    names = tuple(sorted(effect.name for effect in candidate.effects))
    left = plain.synchronous + plain.nonsynchronous
    prior = rich.prior_cost + rich.errors.jump_timing_cost
    return Left(names, candidate.count, rich.synchronous, rich.nonsynchronous, prior, left)


def _from_file(value: dict[str, Any]) -> Left:
    fields: dict[str, Any] = {_FIELDS.get(key, key): content for key, content in value.items()}
    fields["effects"] = tuple(value["effects"])
    return Left(**fields)
