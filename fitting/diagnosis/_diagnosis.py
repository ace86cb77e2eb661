"""The result of a diagnosis: verdict, refitted model, and all figures."""

import dataclasses
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting._json import replace_nonfinite
from fitting._versions import package_versions
from rapi_jax import ECDL, Drive, Recording

SCHEMA = "rapi.diagnosis/1"


@dataclasses.dataclass(frozen=True, eq=False)
class Verdict:
    """The answer, and what to do.

    - `name`: `none`, `unlisted`, or effects joined by +; `mechanism`: the same of their causes.
    - `set`: the smallest set of hypotheses with 95 % of the probability.
    - `sentence`, `advice`: what it means, and what to do.
    - `judged`: whether the data say anything of the device; where they do not, `none` and
      `unlisted` are as probable.
    """

    name: str
    mechanism: str
    effects: tuple[str, ...]
    probability: float
    set: tuple[str, ...]
    reason: str
    sentence: str
    advice: str
    judged: bool = True


@dataclasses.dataclass(frozen=True, eq=False)
class Diagnosis:
    """Where the gap of a model and a recording lies, which effect causes it, how far it closes.

    `model`: the base refitted together with the effects named, for prediction, fitting and
    compensation; `base`: refitted without them, which is what a gap is closed from. `content`: all
    figures, as in `diagnosis.json`. `next_drive`: the next scan, ready to play. `labels`: what the
    candidate effects are called in text, by name.

    >>> from fitting import diagnose
    >>> from rapi_jax.examples import paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> diagnosis = diagnose(None, recording, candidates=(), scan=False)
    >>> diagnosis.verdict.name, diagnosis.verdict.judged
    ('none', True)
    >>> diagnosis.to_dataframe().probability.idxmax()
    'none'
    >>> diagnosis.plot.answers().axes[0].get_xlabel()
    'probability'
    >>> [path.name for path in diagnosis.save("monday")]
    ['diagnosis.json', 'report.html', 'model.rapi']
    """

    recording: Recording
    model: ECDL
    base: ECDL
    verdict: Verdict
    content: dict[str, Any]
    notes: tuple[str, ...]
    seconds: float
    next_drive: Drive | None = None
    labels: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """The diagnosis as in `diagnosis.json` (schema `rapi.diagnosis/1`)."""
        verdict = dataclasses.asdict(self.verdict)
        verdict |= {"effects": list(self.verdict.effects), "set": list(self.verdict.set)}
        return replace_nonfinite(
            {
                "schema": SCHEMA,
                "unit": self.recording.response_unit,
                **self.content,
                "verdict": verdict,
                "notes": list(self.notes),
                "seconds": self.seconds,
                "versions": package_versions(),
                "data_sha256": self.recording.sha256(),
            }
        )

    def page(self) -> str:
        """The report as one self-contained HTML page."""
        from fitting.report.diagnosis._page import render_page

        return render_page(self.to_dict(), self.labels)

    def save(
        self,
        folder: str | os.PathLike[str],
        *,
        name: str = "",
        more: Mapping[str, Any] | None = None,
    ) -> list[Path]:
        """Write `diagnosis.json`, `report.html` and the loadable model to `folder`.

        `name`: of the recording. `more`: further keys of `diagnosis.json`.
        """
        from fitting.report.diagnosis._files import write_diagnosis

        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        return write_diagnosis(self, path, name=name, more=more)

    @property
    def plot(self) -> Any:
        """Pictures: `diagnosis.plot.signature()`, `.answers()`, `.runs()`; see `DiagnosisPlots`."""
        from fitting.report.diagnosis._plots import DiagnosisPlots

        return DiagnosisPlots(self)

    def to_dataframe(self) -> Any:
        """A pandas `DataFrame` with a row for each answer, the likeliest first.

        `probability`; `closed`, `closed_low`, `closed_high`: the share of the gap that it closes on
        held-out data, with its 95 % interval; `in_set`: whether the credible set holds it.
        """
        import pandas as pd

        rows = []
        for one in self.content["hypotheses"]:
            closed = one.get("closed_fraction") or {}
            rows.append(
                {
                    "probability": one["probability"],
                    "mechanism": one["mechanism"],
                    "closed": closed.get("value"),
                    "closed_low": closed.get("low"),
                    "closed_high": closed.get("high"),
                    "in_set": one["name"] in self.verdict.set,
                }
            )
        names = [one["name"] for one in self.content["hypotheses"]]
        return pd.DataFrame(rows, index=pd.Index(names, name="name"))

    def summary(self) -> str:
        """The diagnosis in a few lines, for people."""
        from fitting.report.diagnosis._terminal import render_text

        return render_text(self.to_dict(), self.labels)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return f"<Diagnosis: {self.verdict.name}, probability {self.verdict.probability:.2f}>"

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(self.summary())}</pre>"
