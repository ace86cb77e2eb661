"""The sums that probabilities are made of, as plain numbers: what a calibration is fitted to."""

import dataclasses
from typing import Any

from ._candidates import Candidate
from ._forward_selection import Attribution


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
    locked: float
    loose: float
    prior: float
    identified: float | None = None

    @property
    def name(self) -> str:
        """The effects' names in alphabetical order, joined by +; `none` where there is none."""
        return "+".join(sorted(self.effects)) or "none"

    @property
    def cost(self) -> float:
        """All of it."""
        return self.locked + self.loose + self.prior


@dataclasses.dataclass(frozen=True)
class Evidence:
    """All hypotheses, `none` first; out of how many lines; whether noise was measured."""

    lines: int
    loose_lines: int
    noise_known: bool
    hypotheses: tuple[Left, ...]

    @classmethod
    def of(cls, attribution: Attribution, *, noise_known: bool) -> "Evidence":
        """The evidence of an attribution."""
        errors = attribution.none.rich.errors
        found = (attribution.none, *attribution.candidates)
        size = (errors.locked.size, errors.loose.size)
        return cls(*size, noise_known, tuple(_left(c) for c in found))

    @classmethod
    def from_dict(cls, value: dict[str, Any]) -> "Evidence":
        """From what `to_dict` gave."""
        found = [Left(**(h | {"effects": tuple(h["effects"])})) for h in value["hypotheses"]]
        return cls(value["lines"], value["loose_lines"], value["noise_known"], tuple(found))

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists."""
        return dataclasses.asdict(self)

    def excess(self, left: Left) -> float:
        """Chi-square above what noise alone would leave."""
        return left.locked + left.loose - self.lines - self.loose_lines


def _left(candidate: Candidate) -> Left:
    rich, plain = candidate.rich, candidate.plain
    names = tuple(sorted(effect.name for effect in candidate.effects))
    left = plain.locked + plain.loose
    prior = rich.prior + rich.errors.early_late
    return Left(names, candidate.count, rich.locked, rich.loose, prior, left)
