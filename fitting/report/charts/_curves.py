"""Curves of a chart, whose values appear where a pointer rests."""

from collections.abc import Sequence

from fitting.report.diagnosis._numbers import format_number, format_quantity

from ._axis import Axis
from ._marks import Mark, draw_dots, draw_line

_MOST_TEXTS = 400  # of one curve; beyond it the table has the values
Values = Sequence[float | None]


def describe_points(name: str, x: Values, y: Values, x_unit: str, unit: str) -> list[str]:
    """A text for each point of a curve: its name, x and y with their units."""
    return [
        f"{name}, {format_quantity(a, x_unit)}: {format_quantity(b, unit, sign=True)}"
        if x_unit
        else f"{name}, {format_number(a)}: {format_quantity(b, unit, sign=True)}"
        for a, b in zip(x, y, strict=False)
    ]


def draw_curve(
    axes: tuple[Axis, Axis], x: Values, y: Values, texts: Sequence[str], colour: str
) -> list[Mark]:
    """A line, and a point that is not seen for each text."""
    marks: list[Mark] = [draw_line(axes, x, y, colour)]
    if len(texts) <= _MOST_TEXTS:
        marks.append(draw_dots(axes, list(zip(x, y, texts, strict=False)), "transparent"))
    return marks
