"""A diagnosis on a terminal: verdict, gap, hypotheses, next scan."""

from typing import Any

from rich.console import Group
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from fitting.report._plain_text import plain_text

from ._detectability import describe_size
from ._numbers import SPACE, Scale, format_interval, page_scale
from ._text import (
    Labels,
    describe_baseline,
    describe_hypothesis,
    describe_nonlinearity,
    list_alternatives,
    packaged_labels,
    without_article,
)
from ._which import describe_parameters

_LEAST_SHOWN = 5e-4  # probability; less is 0.000 in the table


def render_lines(diagnosis: dict[str, Any], labels: Labels | None = None) -> Group:
    """The diagnosis for a rich console, from the dictionary of `diagnosis.json`.

    `labels`: of effects by name, where they are other than the package's own.
    """
    verdict, scale = diagnosis["verdict"], page_scale(diagnosis)
    labels = packaged_labels() | dict(labels or {})
    rows: list[Any] = [Text(verdict["sentence"], style="bold"), Text(verdict["advice"])]
    rows.append(Text(_describe_gap(diagnosis["gap"], scale)))
    if baseline := describe_baseline(diagnosis, scale):
        rows.append(Text(baseline.replace(SPACE, " ")))
    if not verdict.get("judged", True):  # no hypothesis was weighed
        return Group(*rows, *_list_notes(diagnosis))
    rows.append(_tabulate(diagnosis, labels, scale))
    if nonlinearity := describe_nonlinearity(diagnosis, scale):
        rows.append(Text(f"nonlinearity after compensation: {nonlinearity}".replace(SPACE, " ")))
    if len(verdict["set"]) > 1:
        names = list_alternatives(verdict["set"], labels)
        rows.append(Text(f"95 % credible set: {names}"))
    scan = diagnosis.get("next_scan")
    if scan is not None:
        rows.append(Text(f"next scan: {scan['reason']}"))
    if shown := _describe_detectability(diagnosis, labels, scale):
        rows.append(Text(shown))
    return Group(*rows, *_list_notes(diagnosis))


def _list_notes(diagnosis: dict[str, Any]) -> list[Text]:
    return [Text(f"note: {note}") for note in diagnosis.get("notes", [])]


def _describe_gap(gap: dict[str, Any], scale: Scale) -> str:
    """The residual of the model alone, of what it is made, and where it lies."""
    text = f"residual of the model alone: {scale(gap['total'])} rms".replace(SPACE, " ")
    parts = (
        ("structural", "not described by the model"),
        ("parametric", "removed by a refit"),
        ("noise_floor", "noise"),
    )
    known = [f"{name} {scale.bare(gap[key])}" for key, name in parts if gap.get(key) is not None]
    made_of = f" ({', '.join(known)})" if known else ""
    return f"{text}{made_of}. {gap.get('sentence') or ''}".strip()


def _describe_detectability(diagnosis: dict[str, Any], labels: Labels, scale: Scale) -> str:
    """The smallest effects that would show, in a line; empty where none is known."""
    found = [e for e in diagnosis.get("detectability") or [] if e.get("value") is not None]
    sizes = [
        f"{without_article(describe_hypothesis(e['effect'], labels))} "
        f"({describe_size(e, scale)[0]})".replace(SPACE, " ")
        for e in found
    ]
    return f"smallest detectable effects (95 %): {', '.join(sizes)}" if sizes else ""


def _tabulate(diagnosis: dict[str, Any], labels: Labels, scale: Scale) -> Table:
    table = Table(title="Hypotheses", title_justify="left")
    for name in ("effect", "probability", "gap closed, held out", "parameters"):
        table.add_column(name, justify="right" if name == "probability" else "left")
    shown = set(diagnosis["verdict"]["set"])
    for h in diagnosis["hypotheses"][:6]:
        if h["name"] not in shown and h["probability"] < _LEAST_SHOWN:
            continue
        found = describe_parameters(h.get("parameters", {}) | h.get("derived", {}), scale)
        table.add_row(
            _name_both(h["name"], labels),
            f"{h['probability']:.3f}",
            format_interval(h.get("closed_fraction")),
            escape(", ".join(f"{name} {value}" for name, value in found)),
        )
    return table


def _name_both(name: str, labels: Labels) -> Text:
    """A hypothesis in the words of the verdict, and below them the name that options take."""
    words = without_article(describe_hypothesis(name, labels))
    shown = Text(words)
    return shown if words == name else shown.append(f"\n{name}", style="dim")


def render_text(diagnosis: dict[str, Any], labels: Labels | None = None) -> str:
    """The same as plain text."""
    return plain_text(render_lines(diagnosis, labels))
