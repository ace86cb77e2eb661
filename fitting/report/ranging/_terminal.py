"""What ranging found, on a terminal: rows as records are read, and a summary."""

from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from . import _words as words

_ROWS = 12


class LiveRows:
    """The latest scans as they are read; they are those of a target at rest, before any track."""

    def __init__(self, index: float) -> None:
        self._index, self._rows, self.count = index, [], 0

    def add(self, table: Any) -> None:
        """Take the scans of a part of the records in."""
        self.count += table.size
        for k in range(max(0, table.size - _ROWS), table.size):
            value, error = table.path[k] / self._index, table.stderr[k] / self._index
            found = np.isfinite(value)
            self._rows.append(
                (
                    f"{table.time_s[k]:.3f}",
                    "up" if table.rising[k] else "down",
                    f"{1e3 * value:.4f}" if found else "-",
                    f"{1e6 * error:.2g}" if found else "-",
                    table.problem[k],
                )
            )
        del self._rows[:-_ROWS]

    def __rich__(self) -> RenderableType:
        """The rows so far."""
        table = Table(
            title=f"{self.count} scans read; apparent distances, as if the target stood still",
            title_justify="left",
        )
        for name in ("time (s)", "direction", "distance (mm)", "std. error (um)"):
            table.add_column(name, justify="left" if name == "direction" else "right")
        table.add_column("problem", style="red")
        for row in self._rows:
            table.add_row(*row[:4], Text(row[4]))
        return table


def render_summary(content: dict[str, Any]) -> Group:
    """The summary for a rich console, from the dictionary of `range.json`."""
    table = Table(box=None, show_header=False, pad_edge=False, padding=(0, 2, 0, 0))
    for name, text in words.facts(content):
        bold = "bold" if name == "distance" else ""
        table.add_row(Text(name), Text(text, style=bold))
    rows: list[RenderableType] = [table]
    if content["budget"]:
        rows.append(_budget(content["budget"]))
    rows += [Text(f"  x {line}", style="red") for line in words.fold(content["faults"])]
    return Group(*rows)


def _budget(lines: list[dict[str, Any]]) -> Table:
    table = Table(title="What the error is made of", title_justify="left")
    table.add_column("source")
    table.add_column("std. error", justify="right")
    table.add_column("remark")
    for line in lines:
        table.add_row(Text(line["source"]), words.budget_size(line), Text(line["note"]))
    return table
