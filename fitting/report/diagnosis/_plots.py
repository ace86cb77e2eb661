"""The pictures of a diagnosis, by name: `diagnosis.plot.signature()`."""

import dataclasses
from typing import Any


@dataclasses.dataclass(frozen=True)
class DiagnosisPlots:
    """Each method returns a figure; `ax` draws into axes of yours.

    `diagnosis`: a `Diagnosis`. Figures are written by `rapi_jax.plot.png` and `svg`, or `savefig`.
    """

    diagnosis: Any

    def answers(self, *, ax: Any = None) -> Any:
        """The probability of each answer."""
        from rapi_jax import plot

        found = self.diagnosis.content["hypotheses"]
        return plot.answers([(one["name"], one["probability"]) for one in found], ax=ax)

    def signature(self, effect: str | None = None, *, ax: Any = None) -> Any:
        """The effect in the data: the mean residual over its axis, without and with it.

        `effect`: which of those named; by default the first. Raises `ValueError` where it is none.
        """
        from rapi_jax import plot

        entries = {entry["effect"]: entry for entry in self.diagnosis.content["signature"]}
        if not entries:
            raise ValueError(
                "this diagnosis names no effect that has a signature. Look at `.plot.runs()`, or "
                "at the maps on the page."
            )
        chosen = next(iter(entries)) if effect is None else effect
        if chosen not in entries:
            raise ValueError(
                f"Argument `effect` is {chosen!r}, but there are signatures of {', '.join(entries)}"
                " alone."
            )
        return plot.signature(entries[chosen], self.diagnosis.recording.response_unit, ax=ax)

    def runs(self, *, ax: Any = None) -> Any:
        """The rms residual of each run, without and with the effects named, and the noise."""
        from rapi_jax import plot

        one = self.diagnosis
        shrinkage, unit = one.content["shrinkage"], one.recording.response_unit
        runs = sorted(shrinkage["by_run"], key=lambda run: run["run"])
        return plot.gap_of_runs(runs, shrinkage["floor"], unit, ax=ax)
