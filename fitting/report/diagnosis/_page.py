"""The page of a diagnosis: one HTML file that needs nothing but itself.

The verdict comes first, then what it looks like in the data, where the gap lies, which effect
causes it, how far it shrinks, what to record next, and how sure all that is. Figures are SVG in the
page; every number is also in a table.
"""

import functools
from typing import Any

import jinja2

from fitting.report._pages import load_template, read_style
from fitting.report.charts._figure import Figure

from . import _text as words
from ._detectability import tabulate_detectability
from ._how_far import describe_next_scan, tabulate_shrinkage
from ._numbers import page_scale
from ._reliability import tabulate_reliability
from ._runs import tabulate_runs
from ._summary import (
    describe_calibration,
    list_cautions,
    list_facts,
    list_provenance,
    write_subtitle,
)
from ._where import tabulate_budget, tabulate_residuals
from ._which import tabulate_hypotheses
from .figures._lines import tabulate_spectral_lines
from .figures._maps import draw_figures
from .figures._signature import draw_signatures

_SCHEMA = "rapi.diagnosis/1"
# Of a signature's axis, the key of the map over the same.
_MAP_OF_AXIS = {
    "phase": "phase",
    "since_turn": "turn-0",
    "session": "session",
    "gain": "session",
    "response": "frequency",
    "drive": "frequency",
}


def render_page(diagnosis: dict, labels: words.Labels | None = None) -> str:
    """The diagnosis of `diagnosis.json` as one HTML page for people.

    **Arguments:**

    - `diagnosis`: the object of `diagnosis.json`. A key that is missing or null leaves its part of
      the page out. Text in it is shown as text, never taken as markup.
    - `labels`: of effects that are not the package's own, by name.

    **Returns:** the page. It asks for nothing: style, script and data are inside. Residuals are in
    the unit of the recording's family that reads best (0.041 GHz as 41 MHz).

    Raises `ValueError` where `diagnosis` has another schema, or no verdict.
    """
    schema = diagnosis.get("schema", _SCHEMA)
    if schema != _SCHEMA or not isinstance(diagnosis.get("verdict"), dict):
        raise ValueError(
            f"Argument `diagnosis` must be the object of a `diagnosis.json` ({_SCHEMA}) with a "
            f"verdict, but its schema is {schema!r} and its keys are {sorted(diagnosis)}. Make one "
            "with `rapi diagnose`."
        )
    return _load_template().render(
        **_make_context(diagnosis, words.packaged_labels() | dict(labels or {}))
    )


def _make_context(diagnosis: dict, labels: words.Labels) -> dict[str, Any]:
    gap = diagnosis.get("gap") or {}
    refit = diagnosis.get("shrinkage") or {}
    where = [e for e in diagnosis.get("where") or [] if isinstance(e, dict)]
    maps = diagnosis.get("maps") or {}
    scale = page_scale(diagnosis)
    drive_unit = str((diagnosis.get("recording") or {}).get("drive_unit") or "")
    drawn = draw_figures(diagnosis, scale, drive_unit)
    signatures = draw_signatures(diagnosis, scale, labels)
    name = str((diagnosis.get("recording") or {}).get("name") or "")
    return {
        "title": " · ".join(filter(None, ["Diagnosis", name])),
        "subtitle": write_subtitle(diagnosis, drive_unit),
        "headline": words.write_headline(diagnosis, labels),
        "place": words.to_sentence(str(gap.get("sentence") or ""))
        if gap.get("significant")
        else "",
        "advice": words.write_advice(diagnosis, drive_unit, labels),
        "cautions": list_cautions(diagnosis),
        "facts": list_facts(diagnosis, scale, labels),
        "budget": tabulate_budget(gap, scale),
        "leading": signatures or drawn[:1],
        "leading_title": "The effect in the data" if signatures else "The residual in the data",
        "figures": _order_figures(drawn if signatures else drawn[1:], diagnosis),
        "grid": tabulate_residuals(where, scale, drive_unit),
        "lines": tabulate_spectral_lines(maps.get("lines"), scale),
        "which": tabulate_hypotheses(diagnosis, labels, scale),
        "seen": tabulate_detectability(diagnosis, labels, scale),
        "far": tabulate_shrinkage(
            refit,
            scale,
            words.credible_names(diagnosis["verdict"])[0],
            judged=bool(diagnosis["verdict"].get("judged", True)),
            richer=(diagnosis.get("base") or {}).get("richer"),
        ),
        "baseline": words.describe_baseline(diagnosis, scale),
        "carried": tabulate_runs(refit, scale, drive_unit),
        "next_scan": describe_next_scan(diagnosis.get("next_scan"), drive_unit, labels),
        "no_scan": words.explain_no_scan(diagnosis["verdict"]),
        "reason": words.to_sentence(str(diagnosis["verdict"].get("reason") or "")),
        "notes": [words.to_sentence(str(note)) for note in diagnosis.get("notes") or []],
        "calibration": describe_calibration(diagnosis),
        "reliability": tabulate_reliability(diagnosis),
        "provenance": list_provenance(diagnosis, drive_unit),
        "style": read_style(),
    }


def _order_figures(drawn: list[Figure], diagnosis: dict) -> list[Figure]:
    """The maps, that over the axis of the named effect's signature first."""
    axes = {e.get("axis") for e in diagnosis.get("signature") or [] if isinstance(e, dict)}
    first = {_MAP_OF_AXIS.get(str(axis)) for axis in axes}
    return sorted(drawn, key=lambda f: f.panels[0].key not in first)


@functools.cache
def _load_template() -> jinja2.Template:
    return load_template("fitting.report.diagnosis", "diagnosis.html")
