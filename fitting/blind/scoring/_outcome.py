"""One device of the check: its answer, and the prediction made before it was revealed."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fitting.blind.protocol._verdict_names import FAILED, UNLISTED, correct_verdict

from ._thresholds import THRESHOLDS

Given = tuple[Mapping[str, Any], Mapping[str, Any] | None, Path | None]


@dataclass(frozen=True, eq=False)
class Outcome:
    """An answer, a prediction, and the folder of its models.

    - `size`: of the effect, in multiples of the noise; 0 for a null.
    - `correct`: the correct verdict.
    - `verdict`: the one given; `error` where there was no diagnosis, which counts as wrong.
    - `credible_set`: names in the 95 % credible set.
    - `probability`: of every hypothesis; of an error, all on `error`.
    """

    name: str
    kind: str
    size: float
    base_misfit: bool
    correct: str
    verdict: str
    credible_set: tuple[str, ...]
    probability: Mapping[str, float]
    withheld: str | None
    answer: Mapping[str, Any]
    diagnosis: Mapping[str, Any]
    baselines: Mapping[str, str]
    error: str | None = None
    folder: Path | None = field(default=None)

    @classmethod
    def of(
        cls,
        answer: Mapping[str, Any],
        prediction: Mapping[str, Any] | None,
        folder: Path | None = None,
    ) -> "Outcome":
        """From the two files; a prediction that is missing counts as an error."""
        found = prediction or {"error": "no prediction was made"}
        withheld = found.get("withheld")
        error = found.get("error")
        report = found.get("diagnosis") or {}
        if error is None and "verdict" not in report:
            error = "the prediction holds no verdict"
        verdict = {} if error is not None else report["verdict"]
        given = {} if error is not None else report.get("hypotheses", ())
        probability = {h["name"]: float(h["probability"]) for h in given}
        return cls(
            name=str(answer["name"]),
            kind=str(answer["kind"]),
            size=float(answer["size"]),
            base_misfit=bool(answer["base_misfit"]),
            correct=UNLISTED if withheld else correct_verdict(answer["truth"]),
            verdict=FAILED if error is not None else str(verdict["name"]),
            credible_set=tuple(verdict.get("set", ())),
            probability=probability or {FAILED: 1.0},
            withheld=withheld,
            answer=answer,
            diagnosis={} if error is not None else report,
            baselines=found.get("baselines") or {},
            error=None if error is None else str(error),
            folder=folder,
        )

    @property
    def is_null(self) -> bool:
        """Whether nothing was to be found."""
        return not self.answer["truth"]

    @property
    def is_detectable(self) -> bool:
        """Whether all that is to be found has 2 sigma or more by itself, of two effects each.

        Of a pair whose other effect is smaller it is not known what is right to say.
        """
        sizes = (self.size, *self.answer.get("alone", ()))
        return self.is_null or min(sizes) >= THRESHOLDS.detectable

    @property
    def is_nameable(self) -> bool:
        """Whether there is an effect of 4 sigma or more, and any other can be detected, too."""
        return not self.is_null and self.size >= THRESHOLDS.nameable and self.is_detectable

    @property
    def confidence(self) -> float:
        """The probability of the verdict; 1 for an error, which counts as certain and wrong."""
        return self.probability.get(self.verdict, 0.0)

    @property
    def names_effects(self) -> bool:
        """Whether the verdict names effects."""
        return bool(self.diagnosis) and bool(self.diagnosis["verdict"]["effects"])

    @property
    def unabsorbed_fraction(self) -> float | None:
        """Share of the true effect that no base absorbs, as the diagnosis saw it, if it did."""
        for hypothesis in self.diagnosis.get("hypotheses", ()):
            if hypothesis["name"] == self.correct:
                value = hypothesis.get("survival")
                return None if value is None else float(value)
        return None

    @property
    def separable(self) -> bool:
        """Whether the true effect can be told from the base; where that is not known it counts."""
        fraction = self.unabsorbed_fraction
        return fraction is None or fraction >= THRESHOLDS.separable
