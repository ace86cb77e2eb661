"""A diagnosis on a terminal: verdict, gap, hypotheses, next scan."""

import io
from typing import Any

from rich.console import Console, Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from ._detectability import describe_size
from ._numbers import SPACE, Scale, format_interval, format_with_error
from ._text import describe_linearity_gain, describe_nonlinearity

_LEAST_SHOWN = 5e-4  # probability; less is 0.000 in the table


def render_lines(diagnosis: dict[str, Any]) -> Group:
    """The diagnosis for a rich console, from the dictionary of `diagnosis.json`."""
    verdict, gap, unit = diagnosis["verdict"], diagnosis["gap"], diagnosis["unit"]
    head = Text(verdict["sentence"], style="bold")
    scale = Scale.of(unit, [gap["total"]])
    parts = [f"residual {scale(gap['total'])} rms".replace(SPACE, " ")]
    parts += [
        f"{name} {scale.bare(gap[name])}" for name in ("parametric", "structural", "noise_floor")
    ]
    where = gap.get("sentence") or "no part of the scan stands out."
    rows: list[Any] = [head, Text(verdict["advice"]), Text(", ".join(parts).replace("_", " "))]
    rows += [Text(where), _tabulate_hypotheses(diagnosis)]
    if factor := describe_linearity_gain(diagnosis):
        rows.append(Text(f"a scan compensated with the effect should be straighter: {factor}"))
    if nonlinearity := describe_nonlinearity(diagnosis, scale):
        rows.append(Text(f"its nonlinearity: {nonlinearity}".replace(SPACE, " ")))
    if len(verdict["set"]) > 1:
        rows.append(Text(f"95 % set: {', '.join(verdict['set'])}"))
    scan = diagnosis.get("next_scan")
    if scan is not None:
        rows.append(Text(f"next scan: {scan['reason']}"))
    if shown := _describe_detectability(diagnosis):
        rows.append(Text(shown))
    rows += [Text(f"  - {note}") for note in diagnosis.get("notes", [])]
    return Group(*rows)


def _describe_detectability(diagnosis: dict[str, Any]) -> str:
    """The smallest effects that would show, in a line; empty where none is known."""
    found = [e for e in diagnosis.get("detectability") or [] if e.get("value") is not None]
    sizes = [f"{e['effect']} ({describe_size(e)[0]})" for e in found]
    return f"smallest effects that would have shown (95 %): {', '.join(sizes)}" if sizes else ""


def _tabulate_hypotheses(diagnosis: dict[str, Any]) -> Table:
    table = Table(title="Hypotheses", title_justify="left")
    for name in ("effect", "probability", "gap closed, held out", "parameters"):
        table.add_column(name, justify="right" if name == "probability" else "left")
    shown = set(diagnosis["verdict"]["set"])
    for h in diagnosis["hypotheses"][:6]:
        if h["name"] not in shown and h["probability"] < _LEAST_SHOWN:
            continue
        found = h.get("parameters", {}) | h.get("derived", {})
        values = ", ".join(
            f"{name} {format_with_error(p['value'], p['stderr'], p['unit'])}"
            for name, p in found.items()
        )
        table.add_row(
            escape(h["name"]),
            f"{h['probability']:.3f}",
            format_interval(h.get("closed_fraction")),
            escape(values),
        )
    return table


def render_text(diagnosis: dict[str, Any]) -> str:
    """The same as plain text."""
    buffer = io.StringIO()
    console = Console(
        file=buffer, width=110, color_system=None, highlight=False, force_jupyter=False
    )
    console.print(render_lines(diagnosis))
    return buffer.getvalue()
