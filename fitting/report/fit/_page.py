"""The page of a fit: verdict, what the model leaves, loops, parameters, held-out errors."""

from typing import TYPE_CHECKING, Any

import numpy as np

from fitting._versions import package_versions
from fitting.report._alike import fold_reasons
from fitting.report._pages import PagePicture
from fitting.report._result_page import Section, list_versions, render_result
from fitting.report.diagnosis._numbers import Scale, unit_text

from ._next_step import describe_next
from ._rows import describe_together, list_runs, list_starts
from ._table import (
    ORIGIN,
    UNDETERMINED,
    describe_model,
    parameter_remark,
    render_verdict,
    round_with_error,
)

if TYPE_CHECKING:
    from fitting.identification._result import FitResult

PAGE = "fit.html"


def render_page(result: "FitResult", source: str | None = None) -> str:
    """The fit as one page, with its pictures in it; `source`: where the recording is."""
    verdict = result.verdict
    size = Scale.of(result.recording.response_unit, [result.rmse])
    scale = (size.unit, size.factor)  # of every error on the page
    facts = [("Verdict", "trusted to predict" if verdict.trusted else "not to be trusted")]
    facts.append(("Residual", f"{size(result.rmse)} rms"))
    if np.isfinite(result.rmse_held_out):
        facts.append(("Held out, last third", f"{size(result.rmse_held_out)} rms"))
    if result.claim is not None:
        facts.append(("Noise", f"{size(result.claim.noise)} rms"))
    facts.append(("Runs", str(len(result.runs))))
    return render_result(
        title="Fit",
        headline=render_verdict(result, scale).plain.rstrip(":"),
        advice=describe_next(
            verdict.reasons, with_gap=verdict.with_gap, source=source, notes=verdict.notes
        ),
        cautions=fold_reasons(verdict.reasons),
        facts=facts,
        sections=_sections(result, size),
        provenance=[
            ("Model", describe_model(result, scale)),
            ("Time taken", f"{result.seconds:.3g} s"),
            ("Versions", list_versions(package_versions())),
            ("Data, SHA-256", result.data_sha256 or result.recording.sha256()),
        ],
    )


def _sections(result: "FitResult", size: Scale) -> list[Section]:
    plot, shown = result.plot, PagePicture.of
    residual = (
        "Noise alone would look the same everywhere along the scan. Many readings are drawn as "
        "their median and the band that holds 95 % of them. A shape that repeats from run to run "
        "is something that the model does not describe."
    )
    together = describe_together(result) or (
        "A correlation near 1 or −1 would say that the data fix the combination better than either "
        "parameter; none is so near."
    )
    runs, starts = list_runs(result, (size.unit, size.factor)), list_starts(result)
    return [
        Section("Residual", residual, shown(plot.residuals())),
        Section(
            "Runs",
            "The width of the loop in percent of the span, the weight in the fit, what the model "
            "leaves, and the correlation of an error with that of the sample before it.",
            heads=runs.heads,
            rows=runs.rows,
        ),
        Section(
            "Measured and modelled loops",
            "The last period of each run. A straight line is taken off each loop, so that "
            "hysteresis and curvature show. Many readings are drawn as their median and the band "
            "that holds 95 % of them; where one of several readings is drawn, the legend says so.",
            shown(plot.loops()),
        ),
        Section(
            "Parameters",
            "Values with standard errors that account for correlated residuals.",
            heads=("parameter", "value", "standard error", "unit", "remark"),
            rows=[_parameter_row(p) for p in result.parameters],
        ),
        Section(
            "Left out of the fit, then predicted",
            "Each row is a fit without a part of the data, compared with that part."
            + (f" {ORIGIN}" if any(h.origin_from_data for h in result.held_out) else ""),
            heads=("left out", "rmse", "of the span", "fitted part"),
            rows=_held_out_rows(result, size),
        ),
        Section(
            "Spectrum of the residual",
            "White noise has a flat spectrum. A line is a resonance or pickup; a slope is slow "
            "noise.",
            shown(plot.spectrum()),
        ),
        Section(
            "Correlation of the parameters' errors",
            together,
            shown(plot.correlation()),
        ),
        Section(
            "Starts of the solver",
            result.describe_starts(),
            heads=starts.heads,
            rows=starts.rows,
        ),
        Section("Notes", "" if result.verdict.notes else "None.", lines=result.verdict.notes),
    ]


def _parameter_row(p: Any) -> tuple[str, ...]:
    value, error = round_with_error(p.value, p.stderr)
    unit = "" if p.unit == "1" else unit_text(p.unit)
    return p.name, value, "" if p.held else error, unit, parameter_remark(p)


def _held_out_rows(result: "FitResult", size: Scale) -> list[tuple[str, ...]]:
    return [
        (
            held.scheme + (" (origin from its mean)" if held.origin_from_data else ""),
            size(held.rmse) if held.determined else UNDETERMINED,
            f"{100 * held.fraction:.2g} %" if held.determined else "",
            size(held.train_rmse),
        )
        for held in result.held_out
    ]
