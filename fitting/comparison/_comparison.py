"""The result of a comparison: what changed between two recordings, and its JSON form."""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting._json import replace_nonfinite
from fitting._versions import package_versions

from ._thresholds import THRESHOLDS

SCHEMA = "rapi.comparison/1"
SEVERAL = "several"
_LEAST_P = 1e-12  # smaller ones depend on tails that no one has seen


def format_p(p: float) -> str:
    """A p-value in text."""
    return f"p = {p:.2g}" if p >= _LEAST_P else f"p < {_LEAST_P:.0e}"


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


@dataclasses.dataclass(frozen=True, eq=False)
class Comparison:
    """What changed between two recordings of one device; see `compare`.

    - `p_value`: of all parameters together, `statistic` by F on `degrees`: one model for both
      against one for each. `p_change`: the smallest of that, of each parameter given the others,
      and of the misfit, for all; `changed` is decided by it, `misfit_changed` by the last alone.
    - `probabilities`: of "none", each parameter alone, and "several"; they sum to 1. `set`: given a
      change, the most probable ones that hold 95 % together.
    - `response`: rms of the change of the response over both recordings' drives, in `unit`.
    - `gap`: of one model in both, where periods show the noise; `misfit`: that of the own fit of
      each, which changes where an effect comes up that the model lacks. `effects`: named by a
      diagnosis, where that was asked for.
    - `recordings`: what is known of each, before and after. `trusted`: whether both fits are.

    >>> from fitting import compare
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> runs = [paper_recording(samples=400, periods=2, seed=k)[0] for k in (0, 1)]
    >>> comparison = compare(*runs, ecdl=paper_device())
    >>> comparison.sentence.split(" (")[0]
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
    gap: GapChange | None
    misfit: GapChange | None
    misfit_changed: bool
    parameters_changed: bool
    effects: tuple[EffectPresence, ...] | None
    recordings: tuple[dict[str, Any], ...]
    model: dict[str, Any]
    trusted: bool
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
    def sentence(self) -> str:
        """What changed, by how much and how sure that is, in one or two sentences."""
        doubt = "" if self.trusted else " Not to be relied on: see the notes."
        what = (self._misfit_sentence, self._parameters_sentence, self._effects_sentence, doubt)
        return "".join(what).strip()

    @property
    def _misfit_sentence(self) -> str:
        if not self.misfit_changed or self.misfit is None:
            return ""
        one, two = self.misfit.before, self.misfit.after
        more = "larger" if two.value > one.value else "smaller"
        where = "after" if two.value > one.value else "before"
        return (
            f"What no parameter of the model explains became {more}: {one.value:.2g} GHz rms above "
            f"noise before, {two.value:.2g} GHz after ({format_p(self.misfit.p_value)}): an effect "
            f"that the model lacks is there {where}, which `--effects` looks for. "
        ).replace("GHz", self.unit)

    @property
    def _parameters_sentence(self) -> str:
        sure = format_p(self.p_change)
        if self.misfit_changed and not self.parameters_changed:
            return "No parameter is seen to have changed beside it."
        if not self.changed:
            most = f"{self.response.high:.2g} {self.unit}"
            return (
                f"Nothing changed that these recordings show ({sure}): over the same drives the "
                f"response differs by at most {most} rms."
            )
        size = f"{self.response.value:.2g} {self.unit} rms over the same drives, {sure}"
        singles = [self[name] for name in self.set if name != SEVERAL]
        if not singles or self.set[0] == SEVERAL:
            moved = [p for p in self.parameters if p.p_holm < THRESHOLDS.change_level]
            if not moved:
                return f"The device changed ({size}), in several parameters that cannot be told."
            named = "; ".join(f"{p.words} `{p.name}` {p.describe(p.difference)}" for p in moved)
            return f"Several parameters changed ({size}): {named}."
        ways = "; or ".join(f"{p.words} `{p.name}` {p.describe(p.change)}" for p in singles)
        more = ", perhaps others with it" if SEVERAL in self.set else ""
        if len(singles) == 1:
            return f"One parameter changed ({size}){more}: {ways}."
        return f"One of these changed, which cannot be told apart ({size}){more}: {ways}."

    @property
    def _effects_sentence(self) -> str:
        if self.effects is None:
            return ""
        alone = [e for e in self.effects if e.only_in]
        if not alone:
            return " The same effects are named in both."
        return " " + " ".join(
            f"{e.label[:1].upper()}{e.label[1:]} is named only {e.only_in}." for e in alone
        )

    def to_dict(self) -> dict[str, Any]:
        """The comparison as in `comparison.json` (schema `rapi.comparison/1`)."""
        kept = ("changed", "p_change", "p_value", "statistic", "probabilities", "trusted")
        kept += ("misfit_changed", "parameters_changed")
        effects = self.effects
        return replace_nonfinite(
            {"schema": SCHEMA, "unit": self.unit, "drive_unit": self.drive_unit}
            | {"sentence": self.sentence, "level": THRESHOLDS.change_level}
            | {key: getattr(self, key) for key in kept}
            | {
                "degrees": list(self.degrees),
                "set": list(self.set),
                "parameters": {p.name: p.to_dict() for p in self.parameters},
                "response_change": dataclasses.asdict(self.response) | {"unit": self.unit},
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
