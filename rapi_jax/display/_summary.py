"""`Summary`: a sentence, facts, a table and notes, as text and as HTML."""

import dataclasses
from collections.abc import Sequence
from html import escape

_CELL = "padding:.15em .8em;text-align:{}"


@dataclasses.dataclass(frozen=True)
class Summary:
    """What a result says of itself.

    - `title`: one sentence. `facts`: (name, value) pairs. `heads`, `rows`: a table, whose columns
      of numbers are set to the right. `notes`: a line each.
    """

    title: str
    facts: Sequence[tuple[str, str]] = ()
    heads: Sequence[str] = ()
    rows: Sequence[Sequence[str]] = ()
    notes: Sequence[str] = ()

    def text(self) -> str:
        """The summary as plain text, columns aligned."""
        lines = [self.title]
        wide = max((len(name) for name, _ in self.facts), default=0)
        lines += [f"  {name:<{wide}}  {value}" for name, value in self.facts]
        if self.rows:
            table = [list(self.heads), *map(list, self.rows)]
            width = [max(len(cell) for cell in column) for column in zip(*table, strict=True)]
            right = [_is_number(column) for column in zip(*self.rows, strict=True)]
            for row in table:
                cells = [
                    f"{cell:>{w}}" if r else f"{cell:<{w}}"
                    for cell, w, r in zip(row, width, right, strict=True)
                ]
                lines.append(("  " + "  ".join(cells)).rstrip())
        lines += [f"  - {note}" for note in self.notes]
        return "\n".join(lines)

    def html(self) -> str:
        """The summary as an HTML fragment, everything in it escaped; for notebooks."""
        parts = [f"<p><strong>{escape(self.title)}</strong></p>"]
        if self.facts:
            parts.append(_table([], [[f"{name}:", value] for name, value in self.facts]))
        if self.rows:
            parts.append(_table(self.heads, self.rows))
        if self.notes:
            items = "".join(f"<li>{escape(note)}</li>" for note in self.notes)
            parts.append(f"<ul>{items}</ul>")
        return f"<div>{''.join(parts)}</div>"


def _table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    side = ["right" if _is_number(column) else "left" for column in zip(*rows, strict=True)]
    top = "".join(
        f'<th style="{_CELL.format(s)}">{escape(h)}</th>' for h, s in zip(heads, side, strict=False)
    )
    body = "".join(
        "<tr>"
        + "".join(
            f'<td style="{_CELL.format(s)}">{escape(c)}</td>'
            for c, s in zip(row, side, strict=True)
        )
        + "</tr>"
        for row in rows
    )
    head = f"<thead><tr>{top}</tr></thead>" if heads else ""
    return f"<table>{head}<tbody>{body}</tbody></table>"


def _is_number(cells: Sequence[str]) -> bool:
    """Whether all cells of a column begin like numbers."""
    return all(cell[:1].isdigit() or cell[:1] in "-+" for cell in cells)


def significant(value: float, digits: int = 4) -> str:
    """A number with `digits` significant digits."""
    return f"{value:.{digits}g}"
