"""A figure of a page: charts with one sentence of what they show, and their numbers as a table."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from fitting.report.diagnosis._numbers import finite_or_none

from ._axis import Axis
from ._marks import Mark

_SHADES = 6  # --s0 to --s5 of the style sheet


@dataclasses.dataclass(frozen=True)
class Table:
    """Cells as text; the first column heads its row."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclasses.dataclass(frozen=True)
class ColourScale:
    """What the colours of a chart mean: `signed` or `plain-scale`, and the texts of its ends."""

    kind: str
    low: str
    high: str


@dataclasses.dataclass(frozen=True)
class Panel:
    """One chart: its height in pixels, axes and marks.

    - `rows`: names of equal rows, the first on top, instead of the ticks of `y`.
    - `legend`: names and colours of curves; `scale`: the meaning of colours.
    - `beside`: a narrow chart on the right of the one before, with the same `y`.
    """

    key: str
    height: int
    x: Axis
    y: Axis
    marks: Sequence[Mark]
    title: str = ""
    rows: Sequence[str] = ()
    legend: Sequence[tuple[str, str]] = ()
    scale: ColourScale | None = None
    beside: bool = False


@dataclasses.dataclass(frozen=True)
class Figure:
    """Charts with one sentence of what they show, how to read them, and their numbers."""

    title: str
    shows: str
    reading: str
    panels: Sequence[Panel]
    table: Table


def shorten(text: str, longest: int = 28) -> str:
    """`text` in at most `longest` characters."""
    return text if len(text) <= longest else text[: longest - 1] + "\N{HORIZONTAL ELLIPSIS}"


def finite_values(values: Any) -> list[float | None]:
    """A row of numbers, None where one is missing; an empty row where there is none."""
    return [finite_or_none(v) for v in values] if isinstance(values, list) else []


def ordered_colour(index: int, count: int) -> str:
    """Colour of one of `count` ordered things: as far from its neighbours' as all allow."""
    whole, part = divmod(index * (_SHADES - 1), count - 1) if count > 1 else (0, 0)
    if not part:
        return f"var(--s{whole})"
    share = round(100 * part / (count - 1))
    return f"color-mix(in oklab, var(--s{whole + 1}) {share}%, var(--s{whole}))"
