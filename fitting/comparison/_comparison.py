"""The result of a comparison: what changed between two recordings, and its JSON form."""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting._json import replace_nonfinite
from fitting._versions import package_versions

from ._differences import EffectPresence, GapChange, Interval, ParameterDifference
from ._sentences import list_details, write_headline
from ._thresholds import THRESHOLDS

SCHEMA = "rapi.comparison/1"


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """What changed between two recordings of one device; see `compare`.

    - `p_value`: of all parameters together, `statistic` by F on `degrees`: one model for both
      against one for each. `p_change`: the smallest of that, of each parameter given the others,
      and of the misfit, for all; `changed` is decided by it, `misfit_changed` by the last alone.
    - `probabilities`: of "none", each parameter alone, and "several"; they sum to 1. `set`: given a
      change, the most probable ones that hold 95 % together.
    - `response`: rms of the change of the response over both recordings' drives, in `unit`;
      `response_by_drive`: at each rate and swing. `detectable_response`: a change of any one
      parameter that moves the response by so much is found in 95 % of cases.
    - `residuals`: data less one model over a period, before and after, at drives that both have.
    - `gap`: of one model in both, where periods show the noise; `misfit`: that of the own fit of
      each, which changes where an effect comes up that the model lacks. `effects`: named by a
      diagnosis, where that was asked for.
    - `recordings`: what is known of each, before and after. `trusted`: whether both fits are.
      `failures`: fits that ended worse than is known to be possible; what changed is then not known
      and `parameters` are none.

    >>> from fitting import compare
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> runs = [paper_recording(samples=400, periods=2, seed=k)[0] for k in (0, 1)]
    >>> comparison = compare(*runs, ecdl=paper_device())
    >>> comparison.headline.split(":")[0]
    'Nothing changed that these recordings show'
    >>> comparison["zeta"].p_value > 0.05
    True
    """

    unit: str
    drive_unit: str
    changed: bool
    p_change: float
    p_value: float
    statistic: float
    degrees: tuple[float, float]
    parameters: tuple[ParameterDifference, ...]
    probabilities: dict[str, float]
    set: tuple[str, ...]
    response: Interval
    detectable_response: float
    response_by_drive: tuple[dict[str, Any], ...]
    residuals: tuple[dict[str, Any], ...]
    gap: GapChange | None
    misfit: GapChange | None
    misfit_changed: bool
    parameters_changed: bool
    effects: tuple[EffectPresence, ...] | None
    recordings: tuple[dict[str, Any], ...]
    model: dict[str, Any]
    trusted: bool
    failures: tuple[str, ...]
    notes: tuple[str, ...]
    seconds: float

    def __getitem__(self, name: str) -> ParameterDifference:
        """The difference of the parameter `name`."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        names = ", ".join(p.name for p in self.parameters)
        raise KeyError(f"no parameter {name!r}; there are {names}")

    @property
    def headline(self) -> str:
        """What changed and by how much, or that nothing did and what would have shown."""
        return write_headline(self)

    @property
    def details(self) -> tuple[str, ...]:
        """The sentences that follow it: how sure that is, which parameters, where most."""
        return tuple(list_details(self))

    @property
    def sentence(self) -> str:
        """The headline and the sentences that follow it."""
        return " ".join((self.headline, *self.details))

    def to_dict(self) -> dict[str, Any]:
        """The comparison as in `comparison.json` (schema `rapi.comparison/1`)."""
        kept = ("changed", "p_change", "p_value", "statistic", "probabilities", "trusted")
        kept += ("misfit_changed", "parameters_changed")
        effects = self.effects
        return replace_nonfinite(
            {"schema": SCHEMA, "unit": self.unit, "drive_unit": self.drive_unit}
            | {"headline": self.headline, "details": list(self.details), "sentence": self.sentence}
            | {"level": THRESHOLDS.change_level, "power": THRESHOLDS.detection_power}
            | {key: getattr(self, key) for key in kept}
            | {
                "degrees": list(self.degrees),
                "set": list(self.set),
                "parameters": {p.name: p.to_dict() for p in self.parameters},
                "response_change": dataclasses.asdict(self.response) | {"unit": self.unit},
                "detectable_response": self.detectable_response,
                "response_by_drive": list(self.response_by_drive),
                "residuals": list(self.residuals),
                "gap": None
                if self.gap is None
                else dataclasses.asdict(self.gap) | {"unit": self.unit},
                "misfit": None
                if self.misfit is None
                else dataclasses.asdict(self.misfit) | {"unit": self.unit},
                "effects": None
                if effects is None
                else [dataclasses.asdict(e) | {"only_in": e.only_in} for e in effects],
                "recordings": dict(zip(("before", "after"), self.recordings, strict=True)),
                "model": self.model,
                "failures": list(self.failures),
                "notes": list(self.notes),
                "seconds": self.seconds,
                "versions": package_versions(),
            }
        )

    def page(self) -> str:
        """The comparison as one self-contained HTML page."""
        from fitting.report.comparison._page import render_page

        return render_page(self.to_dict())

    def save(
        self,
        folder: str | os.PathLike[str],
        *,
        names: tuple[str, str] = ("", ""),
        more: Mapping[str, Any] | None = None,
    ) -> list:
        """Write `comparison.json` and `report.html` to `folder`; `names`: of the recordings.

        `more`: further keys of `comparison.json`.
        """
        from fitting.report.comparison._files import write_comparison

        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        return write_comparison(self.to_dict(), path, names=names, more=more)

    def summary(self) -> str:
        """The comparison in a few lines, for people."""
        from fitting.report.comparison._terminal import render_text

        return render_text(self.to_dict())

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        word = "changed" if self.changed else "unchanged"
        return f"<Comparison: {word}, p = {self.p_change:.2g}>"

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(self.summary())}</pre>"
