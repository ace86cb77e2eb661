"""A heat map: a row per run, a cell per bin, the value as colour and as the cell's text."""

from collections.abc import Sequence

from fitting.report.diagnosis._numbers import format_number, format_quantity

from ._axis import Axis, make_axis
from ._figure import ColourScale, Panel, shorten
from ._marks import Mark, draw_boxes, draw_dots, is_strong, signed_level

_ROW = 24  # pixels
_GAP = 2.0  # pixels between rows
Row = tuple[str, Sequence[float | None]]


def draw_heatmap(
    key: str,
    x: Sequence[float | None],
    rows: Sequence[Row],
    *,
    title: str,
    unit: str,
    x_name: str,
    axis: Axis | None = None,
    texts: Sequence[Sequence[str]] | None = None,
) -> Panel:
    """A heat map of signed values at `x`: the first row on top, zero in the background colour.

    `texts`: a line more for each cell; `x_name`: what x is; `axis`: where the bins alone do not
    make it.
    """
    edges = _edges(x)
    values = [v for _, row in rows for v in row[: len(edges)] if v is not None]
    largest = max(map(abs, values), default=0.0)
    axis = axis or make_axis(title, [], ends=_outer(edges))
    named = [shorten(name) for name, _ in rows]
    cells = []
    for i, (_, row) in enumerate(rows):
        for j, (value, edge) in enumerate(zip(row, edges, strict=False)):
            if value is None or edge is None:
                continue
            text = f"{named[i]}, {x_name} {format_number(x[j])}: "
            text += format_quantity(value, unit, sign=True)
            more = texts[i][j] if texts and j < len(texts[i]) else ""
            text = f"{text}, {more}" if more else text
            cells.append((i, *edge, signed_level(value, largest), text))
    bound = format_quantity(largest, unit, digits=2)
    scale = ColourScale("signed", f"\N{MINUS SIGN}{bound}", f"+{bound}")
    return make_map(key, axis, cells, named, scale)


def make_map(
    key: str,
    axis: Axis,
    cells: Sequence[tuple[int, float, float, str, str]],
    names: Sequence[str],
    scale: ColourScale,
    dots: Sequence[tuple[float, int, str]] = (),
) -> Panel:
    """A map of `cells`: row, left and right edge on `axis`, class of colour, text.

    `dots`: places on the axis and rows that are marked, and the class of colour that each lies on.
    """
    height, count = _ROW * len(names), len(names)
    tall = 100.0 / count
    gap = 100.0 * _GAP / height
    boxes = []
    for i, left, right, level, text in cells:
        a, b = axis.place(left), axis.place(right)
        if a is not None and b is not None:
            boxes.append((a, i * tall, b - a, tall - gap, level, text))
    rows = Axis("", -0.5, count - 0.5)
    marks: list[Mark] = [draw_boxes(boxes)]
    for strong, colour in ((False, "var(--dot)"), (True, "var(--dot-on-strong)")):
        marked = [(at, float(count - 1 - i), "") for at, i, on in dots if is_strong(on) == strong]
        marks += [draw_dots((axis, rows), marked, colour)] if marked else []
    return Panel(key, height, axis, rows, marks, rows=names, scale=scale)


def _edges(x: Sequence[float | None]) -> list[tuple[float, float] | None]:
    """Left and right edge of the bin about each x: half-way to its neighbours."""
    known = sorted({v for v in x if v is not None})
    if len(known) < 2:
        return [None if v is None else (v - 0.5, v + 0.5) for v in x]
    middle = [(a + b) / 2 for a, b in zip(known, known[1:], strict=False)]
    left = [2 * known[0] - middle[0], *middle]
    right = [*middle, 2 * known[-1] - middle[-1]]
    found = dict(zip(known, zip(left, right, strict=True), strict=True))
    return [None if v is None else found[v] for v in x]


def _outer(edges: Sequence[tuple[float, float] | None]) -> tuple[float, float]:
    known = [e for e in edges if e is not None]
    return min((a for a, _ in known), default=0.0), max((b for _, b in known), default=1.0)
