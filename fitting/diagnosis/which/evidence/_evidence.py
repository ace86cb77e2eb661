"""Chi-squares from which probabilities follow and a calibration is fitted, as plain numbers."""

import dataclasses
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._forward_selection import Attribution
from rapi_jax.effects import AbstractLawEffect

# Names in files, where they differ from the fields.
_KEYS = {"synchronous": "locked", "nonsynchronous": "loose"}
_FIELDS = {key: field for field, key in _KEYS.items()}


@dataclasses.dataclass(frozen=True)
class HypothesisEvidence:
    """Chi-square that a hypothesis leaves on the flexible base.

    `synchronous`, `nonsynchronous`: of what repeats with the scan, and of what does not; `prior`:
    of the base's values, and of jumps a sample early or late. `parameters`: number of the effects'.
    `identified`: chi-square on the identified base; `difference_errors`, `identified_errors`:
    standard errors of the differences in chi-square to each of the hypotheses, on the flexible base
    and on the identified one; all `None` where they are not known. `laws`: number of effects that
    change the law of thresholds, as another hysteresis does. `log_prior`: of the effects' values,
    see `AbstractEffect.log_prior`.
    """

    effects: tuple[str, ...]
    parameters: int
    synchronous: float
    nonsynchronous: float
    prior: float
    identified: float | None = None
    difference_errors: tuple[float, ...] | None = None
    laws: int = 0
    identified_errors: tuple[float, ...] | None = None
    log_prior: float = 0.0

    @property
    def name(self) -> str:
        """The effects' names in alphabetical order, joined by +; `none` where there is none."""
        return "+".join(sorted(self.effects)) or "none"

    @property
    def cost(self) -> float:
        """The sum of the three."""
        return self.synchronous + self.nonsynchronous + self.prior


@dataclasses.dataclass(frozen=True)
class Evidence:
    """All hypotheses, `none` first; the numbers of lines; whether noise was measured."""

    lines: int
    nonsynchronous_lines: int
    noise_known: bool
    hypotheses: tuple[HypothesisEvidence, ...]

    @classmethod
    def of(cls, attribution: Attribution, *, noise_known: bool) -> "Evidence":
        """The evidence of an attribution."""
        errors = attribution.none.on_flexible_base.errors
        found = (attribution.none, *attribution.candidates)
        size = (errors.synchronous.size, errors.nonsynchronous.size)
        flexible = _difference_errors([c.on_flexible_base.errors.all**2 for c in found])
        identified = _difference_errors([c.on_base.errors.all**2 for c in found])
        hypotheses = tuple(
            _hypothesis(c, *errors) for c, *errors in zip(found, flexible, identified, strict=True)
        )
        return cls(*size, noise_known, hypotheses)

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

    def excess(self, one: HypothesisEvidence) -> float:
        """Chi-square above what noise alone would leave."""
        return one.synchronous + one.nonsynchronous - self.lines - self.nonsynchronous_lines


def difference_error(one: Float[np.ndarray, " lines"], other: Float[np.ndarray, " lines"]) -> float:
    """Standard error of how much more `one` sums to than `other`; squares of whitened errors.

    As the differences on the lines scatter. Where neither hypothesis is right, so that chi-square's
    difference is not the logarithm of a ratio of likelihoods, it still tells how sure it is which
    of the two is nearer (Q. H. Vuong, Econometrica 57, 307, 1989).
    """
    return float(np.linalg.norm(one - other))


def _difference_errors(squares: list[np.ndarray]) -> list[tuple[float, ...]]:
    return [tuple(difference_error(own, other) for other in squares) for own in squares]


def _hypothesis(
    candidate: Candidate, errors: tuple[float, ...], identified_errors: tuple[float, ...]
) -> HypothesisEvidence:
    flexible, base = candidate.on_flexible_base, candidate.on_base
    names = {effect.name for effect in candidate.effects}
    return HypothesisEvidence(
        effects=tuple(sorted(names)),
        parameters=candidate.count,
        synchronous=flexible.synchronous,
        nonsynchronous=flexible.nonsynchronous,
        prior=flexible.prior_cost + flexible.errors.jump_timing_cost,
        identified=base.synchronous + base.nonsynchronous,
        difference_errors=errors,
        laws=sum(isinstance(effect, AbstractLawEffect) for effect in candidate.effects),
        identified_errors=identified_errors,
        log_prior=float(sum(e.log_prior() for e in flexible.effects if e.name in names)),
    )


def _from_file(value: dict[str, Any]) -> HypothesisEvidence:
    fields: dict[str, Any] = {_FIELDS.get(key, key): content for key, content in value.items()}
    fields["effects"] = tuple(value["effects"])
    for key in ("difference_errors", "identified_errors"):
        if value.get(key) is not None:
            fields[key] = tuple(value[key])
    return HypothesisEvidence(**fields)
