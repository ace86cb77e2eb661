"""The signature of each named effect beside the data: the residual without it and with it."""

import math

from fitting.report.charts._axis import make_axis, make_log_axis
from fitting.report.charts._curves import describe_points
from fitting.report.charts._figure import Figure, Panel, Table, finite_values, ordered_colour
from fitting.report.charts._marks import draw_dots, draw_line
from fitting.report.diagnosis._numbers import Scale, finite_or_none, format_number, unit_text
from fitting.report.diagnosis._text import Labels, describe_hypothesis
from rapi_jax.internal import signature_axis

_ROWS = 4  # curves in one drawing
_SHAPES = {
    "phase": "Such an effect has the same shape in every period.",
    "since_turn": "Such an effect starts at each turning point and lasts as long at any rate.",
    "session": "Such an effect depends on time, not on the scan.",
    "gain": "The slope of the residual over the response, in percent, period by period.",
    "drive": "Such an effect depends on the drive alone, in either direction of the scan.",
    "response": "Such an effect depends on the response alone, in either direction of the scan.",
}


def draw_signatures(diagnosis: dict, scale: Scale, labels: Labels) -> list[Figure]:
    """One figure for each signature of the file that holds a number."""
    entries = [e for e in diagnosis.get("signature") or [] if isinstance(e, dict)]
    drawn = [_draw_signature(e, k, scale, labels) for k, e in enumerate(entries)]
    return [figure for figure in drawn if figure is not None]


def _draw_signature(found: dict, number: int, scale: Scale, labels: Labels) -> Figure | None:
    axis, gain = str(found.get("axis") or ""), found.get("axis") == "gain"
    unit = "%" if gain else scale.unit
    x_unit, factor = _x_unit(found, scale)

    def values(row: dict, key: str) -> list[float | None]:
        own = finite_values(row.get(key))
        return [None if v is None else 100.0 * v if gain else scale.value(v) for v in own]

    rows = [r for r in found.get("rows") or [] if isinstance(r, dict)]
    parts = [
        {
            "name": str(r.get("row") or ""),
            "x": [None if v is None else factor * v for v in finite_values(r.get("x"))],
            "without": values(r, "without"),
            "with": values(r, "with"),
        }
        for r in rows
    ]
    parts = [p for p in parts if any(v is not None for v in p["without"])]
    if not parts:
        return None
    title = describe_hypothesis(str(found.get("effect") or ""), labels)
    quantity = signature_axis(axis, scale.recorded)
    folded = finite_or_none(found.get("period"))
    over = f"{quantity}, folded" if folded else quantity
    most = sorted(parts, key=lambda p: -_explained(p))[:_ROWS]
    shown = [p for p in parts if p in most]
    every_x = [v for p in shown for v in p["x"]]
    every_y = [v for p in shown for k in ("without", "with") for v in p[k]]
    every_y += [v for p in shown for v in _difference(p)]
    x_title = f"{over} ({x_unit})" if x_unit else over
    x_axis = (make_log_axis if axis == "since_turn" else make_axis)(x_title, every_x)
    y_axis = make_axis(f"mean residual ({unit})", every_y, margin=0.08, zero=True)
    panels = []
    for key, heading in (("without", "Without the effect"), ("with", "With the effect")):
        marks, legend = [], []
        for k, p in enumerate(shown):
            colour, name = ordered_colour(k, len(shown)), p["name"] or "data"
            if key == "without":
                marks.append(draw_line((x_axis, y_axis), p["x"], _difference(p), colour))
            texts = describe_points(name, p["x"], p[key], x_unit, unit)
            points = list(zip(p["x"], p[key], texts, strict=False))
            marks.append(draw_dots((x_axis, y_axis), points, colour))
            legend.append((name, colour))
        legend = legend if len(shown) > 1 else []
        panels.append(
            Panel(f"signature-{number}-{key}", 240, x_axis, y_axis, marks, heading, legend=legend)
        )
    before, after = (
        f"{format_number(100.0 * (v or 0.0))} %" if gain else scale(v)
        for v in (finite_or_none(found.get(f"rms_{key}")) for key in ("without", "with"))
    )
    few = ""
    if len(shown) < len(parts):
        few = f" Shown are the {len(shown)} of {len(parts)} curves of which it explains most; all "
        few += "are in the table."
    return Figure(
        f"Residual without and with {title}",
        f"Over the {quantity} the mean residual is {before} rms without it, and {after} with it.",
        "Points are residuals averaged over periods; the line is what the effect explains. "
        f"{_SHAPES.get(axis, '')}{few}".strip(),
        panels,
        _tabulate(parts, over, x_unit, unit),
    )


def _x_unit(found: dict, scale: Scale) -> tuple[str, float]:
    """The unit of an axis as shown, and the factor to it."""
    unit = str(found.get("unit") or "")
    if found.get("axis") == "since_turn":
        return "ms", 1e3
    if found.get("axis") == "response":
        return scale.axis, 1.0
    return ("", 1.0) if unit == "1" else (unit_text(unit), 1.0)


def _difference(part: dict) -> list[float | None]:
    return [
        None if a is None or b is None else a - b
        for a, b in zip(part["without"], part["with"], strict=False)
    ]


def _explained(part: dict) -> float:
    """Rms of what the effect explains."""
    real = [v for v in _difference(part) if v is not None]
    return math.sqrt(sum(v * v for v in real) / len(real)) if real else 0.0


def _tabulate(parts: list[dict], over: str, x_unit: str, unit: str) -> Table:
    body = [
        [p["name"] or "all", format_number(x), *(format_number(v, sign=True) for v in (a, b))]
        for p in parts
        for x, a, b in zip(p["x"], p["without"], p["with"], strict=False)
    ]
    head = ["row", f"{over} ({x_unit})" if x_unit else over, "without", "with"]
    return Table(f"Mean residual without and with it, in {unit}", head, body)
