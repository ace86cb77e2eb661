"""The page of a comparison: one HTML file that needs nothing but itself, and no script.

What changed comes first, then each parameter, the gap, the effects, and how sure all that is.
"""

import functools
from typing import Any

import jinja2
from markupsafe import Markup

from fitting._units import significant
from fitting.report._pages import load_template, read_style
from fitting.report.diagnosis._numbers import format_setting

from ._figure import draw_residuals
from ._sizes import Sizes
from ._tables import (
    ALONE,
    HEADS,
    list_facts,
    list_fits,
    state_p,
    tabulate_effects,
    tabulate_parameters,
    tabulate_sizes,
)

_WIDE = Markup(
    ".comparison td { font-size: 0.8125rem; } .comparison tbody th { min-width: 11rem; }"
    " .comparison .whisker { min-width: 7rem; width: 7rem; }"
    " @media (max-width: 34rem) { .comparison tbody th { min-width: 8rem; }"
    " .dot { display: none; } } #parameters h3 { margin-top: 1.8rem; }"
    " #verdict h1 { margin-bottom: 0.6em; }"
)


def render_page(content: dict[str, Any]) -> str:
    """The comparison of `comparison.json` as one page. Text in it is shown as text."""
    sizes, gap = Sizes.of(content), content["gap"]
    return _load_template().render(
        title="What changed",
        headline=content["headline"].replace("`", ""),
        details=content["details"],
        facts=list_facts(content),
        heads=HEADS,
        alone=ALONE,
        figure=draw_residuals(content, sizes.scale),
        rows=tabulate_parameters(content),
        failed=content["failures"],
        response=sizes.interval(content["response_change"]),
        gap=None
        if gap is None
        else {
            "reference": gap["reference"],
            "before": sizes.interval(gap["before"]),
            "after": sizes.interval(gap["after"]),
            "change": sizes.change(gap["change"]),
        },
        misfit=None
        if content["misfit"] is None
        else {
            "before": sizes.interval(content["misfit"]["before"]),
            "after": sizes.interval(content["misfit"]["after"]),
            "p": state_p(content["misfit"]["p_value"]),
        },
        asked=content["effects"] is not None,
        effects=tabulate_effects(content),
        sizes=tabulate_sizes(content),
        fits=list_fits(content),
        notes=content["notes"],
        p_value=state_p(content["p_value"]),
        statistic=significant(content["statistic"], 4),
        degrees=[f"{x:.4g}" for x in content["degrees"]],
        power=f"{100 * content['power']:g}",
        level=f"{100 * content['level']:g}",
        provenance=_list_provenance(content),
        style=read_style(),
        more=_WIDE,
    )


def _list_provenance(content: dict[str, Any]) -> list[tuple[str, str]]:
    lines = []
    for label, one in content["recordings"].items():
        settings = ", ".join(format_setting(rate, "Hz") for rate in one["rates_hz"])
        swings = ", ".join(format_setting(v, content["drive_unit"]) for v in one["amplitudes"])
        parts = [
            one["name"],
            f"{one['runs']} run{'' if one['runs'] == 1 else 's'}",
            f"{one['samples']} samples",
            settings,
            swings,
            one["recorded_at"] or "",
            "" if one["temperature_c"] is None else format_setting(one["temperature_c"], "°C"),
        ]
        lines.append((label.capitalize(), " · ".join(filter(None, parts))))
        lines.append((f"SHA-256 {label}", one["data_sha256"]))
    model = content["model"]
    effects = f" with {', '.join(model['effects'])}" if model["effects"] else ""
    lines.append(("Model", f"{model['operator']}{effects}, {model['plays']} plays"))
    lines.append(("Time taken", format_setting(content["seconds"], "s")))
    versions = content["versions"].items()
    lines.append(("Versions", ", ".join(f"{name} {number}" for name, number in versions if number)))
    lines.append(("Format", content["schema"]))
    return lines


@functools.cache
def _load_template() -> jinja2.Template:
    return load_template("fitting.report.comparison", "comparison.html")
