"""One figure a parameter: its values over the session, and their distribution beside it."""

import math
from typing import Any

from fitting.report.diagnosis._numbers import format_number, format_quantity, unit_text
from fitting.report.diagnosis.figures._figure import (
    Figure,
    Panel,
    Table,
    escape_text,
    make_axis,
    make_layout,
)

from . import _text as words

READING = (
    "Dots are recordings with one standard error; large ones stand out, and a triangle at the edge "
    "lies beyond it. On the right their distribution, on the left that over the session."
)
_HEIGHT = 250  # pixels
_POINTS = 2000  # drawn of one parameter; outliers always are
_REACH = 10.0  # robust standard deviations: what lies beyond is drawn at the edge
_QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


def draw_parameter(
    parameter: dict,
    group: dict,
    names: list[str],
    outlying: set[int],
    key: str,
    reading: str = READING,
) -> Figure:
    """Values with standard errors over time, their histogram, and the trend where there is one.

    `names`: of all recordings; `outlying`: which of them stand out. `reading`: how to read it.
    """
    unit, factor = words.time_unit(group) if group["hours"] else ("", 1.0)
    first = 0.0 if group["hours"] else 1.0
    time = [t * factor + first for t in group["time"]]
    low, high = _limits(parameter)
    text = unit_text("" if parameter["unit"] == "1" else parameter["unit"])
    title = f"{parameter['name']} ({text})" if text else parameter["name"]
    x = make_axis(
        f"time since the first ({unit})" if group["hours"] else "recording, in the order given",
        domain=[0, 0.76],
    )
    y = make_axis(escape_text(title), range=[low, high], exponentformat="power", nticks=6)
    counts = make_axis("recordings", domain=[0.8, 1], anchor="y", rangemode="tozero", nticks=3)
    layout = make_layout(x, y, xaxis2=counts, bargap=0)
    data = _points(parameter, group, time, names, outlying, (low, high))
    data += _trend(parameter, time, factor, first)
    data.append(_histogram(parameter, (low, high)))
    return Figure(
        parameter["name"],
        _describe(parameter, group),
        reading,
        [Panel(key, _HEIGHT, data, layout)],
        _tabulate(parameter),
    )


def _limits(parameter: dict) -> tuple[float, float]:
    middle, reach = parameter["median"], _REACH * parameter["spread"]
    errors = zip(parameter["values"], parameter["stderr"], strict=True)
    ends = [v + sign * e for v, e in errors for sign in (-1, 1)]
    low, high = max(min(ends), middle - reach), min(max(ends), middle + reach)
    room = 0.06 * (high - low) or abs(middle) or 1.0
    return low - room, high + room


def _points(
    parameter: dict,
    group: dict,
    time: list[float],
    names: list[str],
    outlying: set[int],
    limits: tuple[float, float],
) -> list[dict]:
    values, errors, index = parameter["values"], parameter["stderr"], group["index"]
    step = max(1, math.ceil(len(values) / _POINTS))
    shown = [k for k, i in enumerate(index) if k % step == 0 or i in outlying]
    bars_x: list[float | None] = []
    bars_y: list[float | None] = []
    for k in shown:
        bars_x += [time[k], time[k], None]
        bars_y += [_within(values[k] + s * errors[k], limits) for s in (-1, 1)] + [None]
    bars = {
        "type": "scatter",
        "mode": "lines",
        "x": bars_x,
        "y": bars_y,
        "line": {"color": "var(--calm)", "width": 1},
        "hoverinfo": "skip",
    }
    traces = [bars]
    for inside in (False, True):
        chosen = [k for k in shown if (index[k] in outlying) == inside]
        if chosen:
            traces.append(_dots(parameter, time, chosen, names, index, inside, limits))
    return traces


def _dots(
    parameter: dict,
    time: list[float],
    chosen: list[int],
    names: list[str],
    index: list[int],
    outlying: bool,
    limits: tuple[float, float],
) -> dict:
    values = parameter["values"]
    symbols = [
        "triangle-up" if values[k] > limits[1] else "triangle-down" if values[k] < limits[0]
        else "circle"
        for k in chosen
    ]  # fmt: skip
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [time[k] for k in chosen],
        "y": [_within(values[k], limits) for k in chosen],
        "customdata": [
            f"{escape_text(names[index[k]])}<br>"
            f"{escape_text(format_quantity(values[k], parameter['unit'], digits=5))}"
            for k in chosen
        ],
        "marker": {
            "color": "var(--accent)" if outlying else "var(--s3)",
            "size": 9 if outlying else 5,
            "symbol": symbols,
        },
        "hovertemplate": "%{customdata}<extra></extra>",
    }


def _trend(parameter: dict, time: list[float], factor: float, first: float) -> list[dict]:
    """The line of a trend that was found."""
    drift = parameter["drift"]
    if not drift or not drift["found"]:
        return []
    ends = [min(time), max(time)]
    middle = drift["mean_time"] * factor + first
    slope = drift["change"] / (ends[1] - ends[0])
    return [
        {
            "type": "scatter",
            "mode": "lines",
            "x": ends,
            "y": [drift["middle"] + slope * (x - middle) for x in ends],
            "line": {"color": "var(--ink)", "width": 1.8},
            "hoverinfo": "skip",
        }
    ]


def _histogram(parameter: dict, limits: tuple[float, float]) -> dict:
    """Counts in bins whose width is that of Freedman and Diaconis (1981), at most 60."""
    values = sorted(_within(v, limits) for v in parameter["values"])
    n = len(values)
    width = 2.0 * (_quantile(values, 0.75) - _quantile(values, 0.25)) / n ** (1 / 3)
    span = values[-1] - values[0]
    bins = min(60, max(1, math.ceil(span / width))) if width > 0 and span > 0 else 1
    step = span / bins if span > 0 else (limits[1] - limits[0]) / 20
    counts = [0] * bins
    for v in values:
        counts[min(bins - 1, int((v - values[0]) / step))] += 1
    return {
        "type": "bar",
        "orientation": "h",
        "x": counts,
        "y": [values[0] + (i + 0.5) * step for i in range(bins)] if span > 0 else [values[0]],
        "width": step,
        "xaxis": "x2",
        "marker": {"color": "var(--s1)", "line": {"width": 0}},
        "hovertemplate": "%{x} recordings near %{y:.4~g}<extra></extra>",
    }


def _describe(parameter: dict, group: dict) -> str:
    unit = parameter["unit"]
    text = (
        f"Median {format_quantity(parameter['median'], unit, digits=5)}, robust standard deviation "
        f"{format_quantity(parameter['spread'], unit)}; the typical standard error is "
        f"{format_quantity(parameter['typical_stderr'], unit, digits=2)}."
    )
    drift = parameter["drift"]
    if drift and drift["found"]:
        text += f" It {words.describe_change(parameter, group)}."
    return text


def _tabulate(parameter: dict) -> Table:
    values = sorted(parameter["values"])
    rows = [
        ["smallest" if q == 0 else "largest" if q == 1 else f"{100 * q:.0f} %",
         format_number(_quantile(values, q), 6)]
        for q in _QUANTILES
    ]  # fmt: skip
    unit = "" if parameter["unit"] == "1" else f", in {unit_text(parameter['unit'])}"
    return Table(f"Quantiles of {parameter['name']}{unit}", ["quantile", "value"], rows)


def _quantile(values: list[float], q: float) -> float:
    """By linear interpolation in sorted `values`."""
    at = q * (len(values) - 1)
    i = min(int(at), len(values) - 2) if len(values) > 1 else 0
    after = values[min(i + 1, len(values) - 1)]
    return values[i] + (at - i) * (after - values[i])


def _within(value: Any, limits: tuple[float, float]) -> float:
    return min(max(value, limits[0]), limits[1])
