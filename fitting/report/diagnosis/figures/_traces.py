"""Traces of a report's figures: maps of signed values and curves."""

import math
from collections.abc import Sequence
from typing import Any

from fitting.report.diagnosis._numbers import format_number

from ._figure import Panel, escape_text, make_axis, make_layout

# The middle of the scale is the page's background: zero residual has no colour.
DIVERGING = [[i / 6, f"var(--d{i})"] for i in range(7)]
SEQUENTIAL = [[i / 4, f"var(--q{i})"] for i in range(5)]
_SHADES = 6  # --s0 to --s5 of the style sheet


def ordered_colour(index: int, count: int) -> str:
    """Colour of one of `count` ordered things."""
    step = 0 if count < 2 else round(index * (_SHADES - 1) / (count - 1))
    return f"var(--s{step})"


def draw_heatmap(
    key: str,
    x: Sequence[float | None],
    rows: Sequence[tuple[str, Sequence[float | None]]],
    *,
    x_title: str,
    x_axis: dict | None = None,
    unit: str,
    hover: str,
    texts: Sequence[Sequence[str]] | None = None,
) -> Panel:
    """A heat map of signed values: the first row on top, zero in the background colour.

    `texts`: a line for each cell's label; `hover`: the name of x; `x_axis`: further properties of
    its axis.
    """
    z = [list(values) for _, values in rows]
    largest = max((abs(v) for row in z for v in row if v is not None), default=0.0) or 1.0
    labels = [escape_text(label) for label, _ in rows]
    end = round_down(largest)
    custom = [
        [
            f"{labels[i]}{'<br>' + escape_text(texts[i][j], 80) if texts else ''}"
            for j in range(len(row))
        ]
        for i, row in enumerate(z)
    ]
    trace = {
        "type": "heatmap",
        "x": list(x),
        # Positions, not labels: two runs may well bear the same name.
        "y": list(range(len(rows))),
        "z": z,
        "customdata": custom,
        "colorscale": DIVERGING,
        "zmin": -largest,
        "zmax": largest,
        "xgap": 0,
        "ygap": 2,
        "hoverongaps": False,
        "hovertemplate": f"%{{customdata}}<br>{hover} %{{x:.3~g}}<br>"
        f"%{{z:+.3~g}} {escape_text(unit)}<extra></extra>",
        "colorbar": make_colour_bar(
            unit, [-end, 0.0, end], [format_number(v, 1) for v in (-end, 0, end)]
        ),
    }
    y_axis = make_row_axis([label for label, _ in rows])
    drawn = make_layout(make_axis("", showline=False, **(x_axis or {})), y_axis)
    return Panel(key, map_height(len(rows)), [trace], drawn, below=x_title)


def make_row_axis(labels: Sequence[str]) -> dict:
    """An axis of named rows, the first on top."""
    return make_axis(
        "",
        showline=False,
        tickcolor="rgba(0,0,0,0)",
        tickmode="array",
        tickvals=list(range(len(labels))),
        ticktext=[escape_text(label) for label in labels],
        range=[len(labels) - 0.5, -0.5],
    )


def map_height(rows: int) -> int:
    """Height of a map in pixels: its rows, the scale above and the axis below."""
    return 24 * rows + 72


def make_colour_bar(unit: str, places: Sequence[float], texts: Sequence[str]) -> dict:
    """A horizontal colour bar above the figure; its last number bears the unit."""
    return {
        "orientation": "h",
        "y": 1.0,
        "yanchor": "bottom",
        "x": 0.97,
        "xanchor": "right",
        "thickness": 6,
        "len": 0.5,
        "outlinewidth": 0,
        "ticklen": 3,
        "tickfont": {"size": 11},
        "xpad": 0,
        "ypad": 4,
        "ticklabelposition": "outside top",
        "tickmode": "array",
        "tickvals": list(places),
        "ticktext": [*texts[:-1], f"{texts[-1]} {escape_text(unit, 12)}"],
    }


def round_down(value: float) -> float:
    """The largest of 1, 2 or 5 times a power of ten that is not above a positive `value`."""
    power = 10.0 ** math.floor(math.log10(value))
    return power * next(step for step in (5, 2, 1) if step * power <= value * (1 + 1e-9))


def draw_curve(
    x: Sequence[float | None],
    y: Sequence[float | None],
    *,
    name: str,
    color: str,
    hover: str,
    unit: str,
    **more: Any,
) -> dict:
    """One curve."""
    return {
        "type": "scatter",
        "mode": "lines",
        "x": list(x),
        "y": list(y),
        "name": escape_text(name),
        "line": {"color": color, "width": 1.8},
        "hovertemplate": f"{escape_text(name)}<br>{escape_text(hover)} %{{x:.3~g}}<br>"
        f"%{{y:+.3~g}} {escape_text(unit)}<extra></extra>",
    } | more


def axis_range(values: Sequence[float | None], margin: float = 0.08) -> list[float]:
    """A range with zero in it, a little wider than the values."""
    real = [v for v in values if v is not None and math.isfinite(v)]
    low, high = min(real, default=0.0), max(real, default=0.0)
    low, high = min(low, 0.0), max(high, 0.0)
    room = margin * (high - low) or 1.0
    return [low - room, high + room]


def make_log_axis(values: Sequence[float | None]) -> dict:
    """A logarithmic axis over positive `values`, with ticks at 1, 2 and 5 of each decade."""
    real = [v for v in values if v is not None and v > 0]
    low, high = math.log10(min(real)), math.log10(max(real))
    steps = (1, 2, 5) if high - low < 3 else (1,)
    places = [m * 10.0**k for k in range(math.floor(low), math.ceil(high) + 1) for m in steps]
    shown = [v for v in places if low - 0.01 <= math.log10(v) <= high + 0.01]
    return {"type": "log", "range": [low, high], "tickvals": shown} | {
        "ticktext": [f"{v:g}" for v in shown]
    }
