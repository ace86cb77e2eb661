"""Figures of a report as plotly.js takes them, in colours that the page's style sheet names.

A colour is written `var(--name)`; the page's script replaces it by what the style sheet says for
light or dark, so that one figure serves both.
"""

import dataclasses
import html
from collections.abc import Sequence
from typing import Any

from fitting.report.diagnosis._numbers import finite_or_none


@dataclasses.dataclass(frozen=True)
class Table:
    """Cells as text; the first column heads its row."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]


@dataclasses.dataclass(frozen=True)
class Panel:
    """One drawing: its height in pixels, plotly.js's data and layout, titles above and below."""

    key: str
    height: int
    data: list[dict]
    layout: dict
    title: str = ""
    # plotly.js sets the title of an axis on its numbers where a colour scale is near.
    below: str = ""


@dataclasses.dataclass(frozen=True)
class Figure:
    """Drawings with one sentence of what they show, how to read them, and their numbers."""

    title: str
    shows: str
    reading: str
    panels: Sequence[Panel]
    table: Table


def escape_text(text: str, longest: int = 28) -> str:
    """`text` for plotly.js, which else takes tags, `%{...}` and `var(...)` at their word."""
    short = text if len(text) <= longest else text[: longest - 1] + "\N{HORIZONTAL ELLIPSIS}"
    return html.escape(short).replace("%", "&#37;").replace("(", "&#40;")


def finite_values(values: Any) -> list[float | None]:
    """A row of numbers, None where one is missing; an empty row where there is none."""
    return [finite_or_none(v) for v in values] if isinstance(values, list) else []


def make_axis(title: str, **more: Any) -> dict:
    """An axis in the page's hand."""
    base = {
        **({"title": {"text": title, "font": {"size": 12}, "standoff": 8}} if title else {}),
        "fixedrange": True,  # Dragging on a phone scrolls the page.
        "zeroline": False,
        "showgrid": False,
        "ticks": "outside",
        "ticklen": 4,
        "tickcolor": "var(--rule)",
        "linecolor": "var(--rule)",
        "showline": True,
        "automargin": True,
    }
    return base | more


def make_layout(x: dict, y: dict, **more: Any) -> dict:
    """The layout common to all figures: transparent, so that the page shows through."""
    return {
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": "var(--sans)", "size": 12, "color": "var(--soft)"},
        "margin": {"l": 8, "r": 8, "t": 0, "b": 8, "pad": 0},
        "hoverlabel": {
            "bgcolor": "var(--ground)",
            "bordercolor": "var(--rule)",
            "font": {"family": "var(--sans)", "color": "var(--ink)"},
        },
        "dragmode": False,
        "showlegend": False,
        "legend": {
            "orientation": "h",
            "x": 0,
            "y": 1.02,
            "yanchor": "bottom",
            "traceorder": "normal",
        },
        "xaxis": x,
        "yaxis": y,
    } | more
