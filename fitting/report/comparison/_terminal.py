"""A comparison on a terminal, and as text."""

from typing import Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from fitting.report._plain_text import plain_text

from ._tables import (
    HEADS,
    list_facts,
    list_fits,
    tabulate_effects,
    tabulate_parameters,
    tabulate_sizes,
)

_SHOWN = (2, 3, 4, 7)  # of the columns: a terminal is narrow


def render_lines(content: dict[str, Any]) -> Group:
    """The comparison for a rich console, from the dictionary of `comparison.json`."""
    head = Text(content["headline"], style="bold red" if content["changed"] else "bold green")
    table = Table(title="Parameters, after less before (p for all together)", title_justify="left")
    table.add_column("name")
    for k in _SHOWN:
        table.add_column(HEADS[k], justify="right")
    for row in tabulate_parameters(content):
        cells = [row["cells"][k] for k in _SHOWN]
        name = row["code"] or row["words"]
        texts = [Text(cell.replace("\N{NO-BREAK SPACE}", " ")) for cell in (name, *cells)]
        table.add_row(*texts, style="bold" if row["changed"] else "")
    rows: list[Any] = [head, *(Text(line) for line in content["details"])]
    rows += [table] if content["parameters"] else []
    facts = [*list_facts(content), *list_fits(content)]
    rows += [Text(f"{name[:1].lower()}{name[1:]}: {text}") for name, text in facts]
    rows += [
        Text(f"{label}: {before} before, {after} after, {where}")
        for label, before, after, where in tabulate_effects(content)
    ]
    rows += [Text(f"{words} {label}: {size}") for words, label, size in tabulate_sizes(content)]
    rows += [Text(f"  - {note}") for note in content["notes"]]
    return Group(*rows)


def render_text(content: dict[str, Any]) -> str:
    """The same as plain text."""
    return plain_text(render_lines(content))
