"""One figure a parameter: its values over the session, and their distribution beside it."""

import math
from typing import Any

from fitting._parameter_words import describe_parameter
from fitting.report.charts._axis import Axis, make_axis, round_values, write_tick
from fitting.report.charts._figure import ColourScale, Figure, Panel, Table
from fitting.report.charts._marks import (
    Areas,
    Boxes,
    Line,
    Mark,
    draw_areas,
    draw_boxes,
    draw_dots,
    draw_line,
    plain_level,
)
from fitting.report.diagnosis._numbers import (
    format_number,
    format_quantity,
    format_with_error,
    unit_text,
)

from . import _text as words

READING = (
    "Dots are recordings with one standard error; large ones stand out, and a triangle at the edge "
    "lies beyond it. Where they are many, colour is the number of recordings in a cell."
)
_BESIDE = " On the right is their distribution."
_FEW = 8  # recordings; fewer have no distribution, and are listed one by one
_HEIGHT = 220  # pixels
_CELLS = (48, 24)  # of a density, across and up
_REACH = 10.0  # robust standard deviations: what lies beyond is drawn at the edge
_QUANTILES = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)


def draw_parameter(
    parameter: dict,
    group: dict,
    names: list[str],
    outlying: set[int],
    key: str,
    reading: str = READING,
    points: int = 250,
) -> Figure:
    """Values with standard errors over time, their histogram, and the trend where there is one.

    Fewer than eight have no histogram, and each is in the table.

    `names`: of all recordings; `outlying`: which of them stand out. `reading`: how to read it.
    `points`: recordings drawn one by one; more are drawn as a density, but for those that stand
    out.
    """
    unit, factor = words.time_unit(group) if group["hours"] else ("", 1.0)
    first = 0.0 if group["hours"] else 1.0
    time = [t * factor + first for t in group["time"]]
    low, high = _limits(parameter)
    text = unit_text("" if parameter["unit"] == "1" else parameter["unit"])
    title = f"{parameter['name']} ({text})" if text else parameter["name"]
    if group["hours"]:
        x = make_axis(f"time since the first ({unit})", time)
    else:
        whole = [v for v in round_values(min(time), max(time), 5) if v == round(v)]
        x = make_axis("recording, in the order given", time, ticks=whole)
    y = make_axis(title, [], ends=(low, high))
    values, index, scale = parameter["values"], group["index"], None
    few = len(values) <= points
    shown = [k for k in range(len(values)) if few or index[k] in outlying]
    marks: list[Mark] = []
    if not few:
        density, scale = _density(values, time, (x, y))
        marks.append(density)
    marks += _points(parameter, group, time, names, outlying, shown, (x, y))
    marks += _trend(parameter, time, factor, first, (x, y))
    panels = [Panel(key, _HEIGHT, x, y, marks, scale=scale)]
    table = _list_values(parameter, [names[k] for k in index])
    if len(values) >= _FEW:
        counts, bars = _histogram(parameter, y)
        panels.append(Panel(f"{key}-histogram", _HEIGHT, counts, y, [bars], beside=True))
        reading += _BESIDE if reading else ""
        table = _tabulate(parameter)
    return Figure(parameter["name"], _describe(parameter, group), reading, panels, table)


def _limits(parameter: dict) -> tuple[float, float]:
    middle = parameter["median"]
    reach = _REACH * max(parameter["spread"], parameter["typical_stderr"])
    errors = zip(parameter["values"], parameter["stderr"], strict=True)
    ends = [v + sign * e for v, e in errors for sign in (-1, 1)]
    low, high = min(ends), max(ends)
    if len(parameter["values"]) >= _FEW:
        low, high = max(low, middle - reach), min(high, middle + reach)
    room = 0.06 * (high - low) or abs(middle) or 1.0
    return low - room, high + room


def _points(
    parameter: dict,
    group: dict,
    time: list[float],
    names: list[str],
    outlying: set[int],
    shown: list[int],
    axes: tuple[Axis, Axis],
) -> list[Mark]:
    """The recordings of numbers `shown`, with their standard errors."""
    values, index = parameter["values"], group["index"]
    marks: list[Mark] = [_error_bars(parameter, time, shown, axes)]
    for inside in (False, True):
        chosen = [k for k in shown if (index[k] in outlying) == inside]
        points = [
            (
                time[k],
                _within(values[k], axes[1]),
                f"{names[index[k]]}: {format_quantity(values[k], parameter['unit'], digits=5)}",
            )
            for k in chosen
        ]
        shapes = [
            "up" if values[k] > axes[1].high else "down" if values[k] < axes[1].low else "dot"
            for k in chosen
        ]
        colour, radius = ("var(--accent)", 4.5) if inside else ("var(--s3)", 2.5)
        marks.append(draw_dots(axes, points, colour, radius, shapes))
    return marks


def _error_bars(
    parameter: dict, time: list[float], shown: list[int], axes: tuple[Axis, Axis]
) -> Line:
    x: list[float | None] = []
    y: list[float | None] = []
    for k in shown:
        value, error = parameter["values"][k], parameter["stderr"][k]
        x += [time[k], time[k], None]
        y += [_within(value - error, axes[1]), _within(value + error, axes[1]), None]
    return draw_line(axes, x, y, "var(--calm)", width=1.0)


def _density(
    values: list[float], time: list[float], axes: tuple[Axis, Axis]
) -> tuple[Areas, ColourScale]:
    """Recordings in each cell of the chart as colour, and what the colours mean."""
    across, up = _CELLS
    counts: dict[tuple[int, int], int] = {}
    for t, value in zip(time, values, strict=True):
        at, height = axes[0].place(t), axes[1].place(_within(value, axes[1]))
        if at is not None and height is not None:
            cell = (min(across - 1, int(at / 100 * across)), min(up - 1, int(height / 100 * up)))
            counts[cell] = counts.get(cell, 0) + 1
    most = max(counts.values(), default=1)
    width, tall = 100.0 / across, 100.0 / up
    cells = [
        (i * width, 100.0 - (j + 1) * tall, width, tall, plain_level(0.15 + 0.85 * n / most), "")
        for (i, j), n in counts.items()
    ]
    return draw_areas(cells), ColourScale("plain-scale", "0", words.plural(most, "recording"))


def _trend(
    parameter: dict, time: list[float], factor: float, first: float, axes: tuple[Axis, Axis]
) -> list[Mark]:
    """The line of a trend that was found."""
    drift = parameter["drift"]
    if not drift or not drift["found"]:
        return []
    ends: list[float | None] = [min(time), max(time)]
    middle = drift["mean_time"] * factor + first
    slope = drift["change"] / (max(time) - min(time))
    heights: list[float | None] = [
        drift["middle"] + slope * (x - middle) for x in (min(time), max(time))
    ]
    return [draw_line(axes, ends, heights, "var(--ink)")]


def _histogram(parameter: dict, y: Axis) -> tuple[Axis, Boxes | Areas]:
    """Counts in bins whose width is that of Freedman and Diaconis (1981), at most 60."""
    values = sorted(_within(v, y) for v in parameter["values"])
    n = len(values)
    width = 2.0 * (_quantile(values, 0.75) - _quantile(values, 0.25)) / n ** (1 / 3)
    span = values[-1] - values[0]
    bins = min(60, max(1, math.ceil(span / width))) if width > 0 and span > 0 else 1
    step = span / bins if span > 0 else (y.high - y.low) / 20
    counts = [0] * bins
    for v in values:
        counts[min(bins - 1, int((v - values[0]) / step))] += 1
    most = float(max(counts))
    ticks = [(v, write_tick(v)) for v in round_values(0.0, most, 2) if v == round(v)]
    axis = Axis("recordings", 0.0, 1.05 * most, ticks)
    start = values[0] if span > 0 else values[0] - step / 2
    boxes = []
    for i, count in enumerate(counts):
        low, high = (y.place(start + k * step) or 0.0 for k in (i, i + 1))
        text = f"{words.plural(count, 'recording')} from {format_number(start + i * step, 4)} to "
        text += format_number(start + (i + 1) * step, 4)
        boxes.append((0.0, 100.0 - high, axis.place(float(count)) or 0.0, high - low, "bar", text))
    return axis, draw_boxes(boxes)


def _describe(parameter: dict, group: dict) -> str:
    unit = parameter["unit"]
    called = describe_parameter(parameter["name"], unit.partition("/")[0])  # d_1: response/drive
    text = "" if called == parameter["name"] else f"{called[:1].upper()}{called[1:]}. "
    text += (
        f"Median {format_quantity(parameter['median'], unit, digits=5)}, robust standard deviation "
        f"{format_quantity(parameter['spread'], unit)}; the typical standard error is "
        f"{format_quantity(parameter['typical_stderr'], unit, digits=2)}."
    )
    drift = parameter["drift"]
    if drift and drift["found"]:
        text += f" It {words.describe_change(parameter, group)}."
    return text


def _list_values(parameter: dict, names: list[str]) -> Table:
    unit = parameter["unit"]
    numbers = zip(names, parameter["values"], parameter["stderr"], strict=True)
    rows = [[name, format_with_error(value, stderr, unit)] for name, value, stderr in numbers]
    return Table(f"Values of {parameter['name']}", ["recording", "value"], rows)


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


def _within(value: Any, axis: Axis) -> float:
    return min(max(value, axis.low), axis.high)
