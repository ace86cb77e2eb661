"""The page of a batch: one HTML file that needs nothing but itself.

How many recordings are done, trusted and failed comes first, with those that stand out and the
parameters that drift; then each parameter, the failures, and every recording with a link to its
own files.
"""

import functools
from typing import Any

import jinja2
import numpy as np

from fitting.report._pages import load_template, read_style
from fitting.report.diagnosis._numbers import Scale, finite_or_none, format_quantity
from rapi_jax.io import printable

from . import _tables as tables
from . import _text as words
from ._figures import READING, draw_parameter

_MOST = 1000  # rows of the table of recordings; all are in `results.csv`
_MOST_REASONS = 300  # rows of a table with reasons, which are up to `_LONGEST` long
_LONGEST = 400  # characters of a text
_DRAWN = 24  # figures; of further parameters the page has the numbers
_POINTS = 4000  # of all figures; more recordings are drawn as a density


def render_page(content: dict[str, Any]) -> str:
    """The page of `fitting.batch.table`'s summary. Text in it is shown as text."""
    content = _printable(content)
    rows, groups = content["rows"], content["groups"]
    found = _outliers(rows, groups)
    outlying = {one["row"] for one in found}
    names = [row["name"] for row in rows]
    parts, drawn = [], 0
    number = sum(len(group["parameters"]) for group in groups)
    points = min(250, _POINTS // max(1, min(number, _DRAWN)))
    for g, group in enumerate(groups):
        figures = []
        if len(group["index"]) > 1:
            room = max(0, _DRAWN - drawn)
            figures = [
                draw_parameter(
                    one,
                    group,
                    names,
                    outlying,
                    f"{g}-{k}",
                    "" if drawn or k else READING,
                    points,
                )
                for k, one in enumerate(group["parameters"][:room])
            ]
        drawn += len(figures)
        parts.append(_describe_group(group, figures, len(groups) > 1))
    head, recordings = tables.tabulate_recordings(rows, outlying, _MOST)
    return _load_template().render(
        title="Batch of recordings",
        headline=words.write_headline(rows),
        stands_out=words.summarise_outliers(
            found, any(g["compared"] for g in groups), content["fewest_compared"]
        ),
        drifts=words.summarise_drift(groups, content["fewest_in_time"]),
        facts=_facts(rows, found, groups),
        outliers=found,
        untrusted=tables.tabulate_untrusted(rows, _MOST_REASONS),
        verdicts=tables.tabulate_verdicts(rows),
        groups=parts,
        failures=tables.tabulate_failures(rows, _MOST_REASONS),
        head=head,
        recordings=recordings,
        left_out=max(0, len(rows) - _MOST),
        significance=f"{100 * content['significance']:g}",
        permutations=content["permutations"],
        fewest=content["fewest_compared"],
        style=read_style(),
    )


def _printable(node: Any) -> Any:
    """The same with every text, key or value, on one line and without control characters."""
    if isinstance(node, dict):
        return {printable(key): _printable(value) for key, value in node.items()}
    if isinstance(node, list):
        return [_printable(item) for item in node]
    if not isinstance(node, str):
        return node
    whole = printable(node, 10 * len(node))  # an escaped character has ten letters at most
    return words.cut_at_words(whole, _LONGEST)


def _outliers(rows: list[dict], groups: list[dict]) -> list[dict[str, Any]]:
    """Recordings that stand out, the clearest first."""
    found = [
        {
            "row": one["row"],
            "name": rows[one["row"]]["name"],
            "link": tables.link(rows[one["row"]]),
            "why": words.explain_outlier(one, group),
            "p": one["p"],
            "shown_p": words.format_p(one["p"]),
        }
        for group in groups
        for one in group["outliers"]
    ]
    return sorted(found, key=lambda one: one["p"])


def _describe_group(group: dict, figures: list, several: bool) -> dict[str, Any]:
    size = words.plural(len(group["index"]), "recording")
    return {
        "title": f"{words.name_group(group['kind'])}: {size}" if several else "",
        "size": size,
        "compared": group["compared"],
        "together": group["together"],
        "over": words.over_session(group),
        "rows": tables.tabulate_parameters(group),
        "drifting": [bool(p["drift"] and p["drift"]["found"]) for p in group["parameters"]],
        "figures": figures,
        "undrawn": len(group["parameters"]) - len(figures) if figures else 0,
    }


def _facts(rows: list[dict], found: list[dict], groups: list[dict]) -> list[tuple[str, str]]:
    lines = [("Recordings", str(len(rows))), ("Done", str(words.count(rows, status="done")))]
    if any(row["trusted"] is not None for row in rows):
        lines.append(("Trusted", str(words.count(rows, status="done", trusted=True))))
        lines.append(("Not trusted", str(words.count(rows, status="done", trusted=False))))
    for status, label in (("failed", "Failed"), ("skipped", "Skipped")):
        number = words.count(rows, status=status)
        if number or status == "failed":
            lines.append((label, str(number)))
    if unreadable := words.count(rows, status="unreadable"):
        lines.append(("Cannot be read", str(unreadable)))
    if any(g["compared"] for g in groups):
        lines.append(("Stand out", str(len(found))))
    trends = [p["drift"]["found"] for g in groups for p in g["parameters"] if p["drift"]]
    if trends:
        lines.append(("Drifting", f"{sum(trends)} of {words.plural(len(trends), 'parameter')}"))
    units = {row["unit"] for row in rows if finite_or_none(row["rmse"]) is not None}
    if len(units) == 1:
        known = [row["rmse"] for row in rows if finite_or_none(row["rmse"]) is not None]
        unit = str(units.pop() or "")
        middle = float(np.median(known))
        lines.append(("Residual", f"{Scale.of(unit, [middle])(middle)} rms, median"))
    lines.append(("Computing", format_quantity(sum(row["seconds"] for row in rows), "s")))
    return lines


@functools.cache
def _load_template() -> jinja2.Template:
    return load_template("fitting.report.batch", "batch.html")
