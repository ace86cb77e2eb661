"""The picture of a comparison: what one model leaves of both recordings over a period."""

import math
from typing import Any

from fitting.report.charts._axis import make_axis
from fitting.report.charts._curves import describe_points, draw_curve
from fitting.report.charts._figure import Figure, Panel, Table, finite_values
from fitting.report.diagnosis._numbers import Scale, format_quantity, format_setting, unit_text

_MOST = 2  # drives that are drawn; the table has all
_COLOURS = {"before": "var(--soft)", "after": "var(--accent)"}


def draw_residuals(content: dict[str, Any], scale: Scale) -> Figure | None:
    """Where the two differ most, in the page's unit; `None` where they share no drive."""
    rows = content.get("residuals") or []
    if not rows:
        return None
    change = [_rms(_difference(row)) for row in rows]
    order = sorted(range(len(rows)), key=lambda k: -change[k])
    drawn = [rows[k] for k in sorted(order[:_MOST])]
    values = [v for row in drawn for name in _COLOURS for v in finite_values(row[name])]
    y = make_axis(
        f"data less model ({scale.unit})", [scale.value(v) for v in values], margin=0.06, zero=True
    )
    x = make_axis("part of a period since the drive's minimum", [], ends=(0.0, 1.0))
    panels = []
    for key, row in enumerate(drawn):
        marks = []
        for name, colour in _COLOURS.items():
            curve = [scale.value(v) for v in row[name]]
            texts = describe_points(name, row["period"], curve, "", scale.unit)
            marks += draw_curve((x, y), row["period"], curve, texts, colour)
        title = _name(row, content["drive_unit"])
        panels.append(Panel(f"left-{key}", 240, x, y, marks, title, legend=list(_COLOURS.items())))
    first = rows[order[0]]
    one, two = (format_quantity(scale.value(_rms(first[k])), scale.unit) for k in _COLOURS)
    return Figure(
        "What one model leaves of both",
        f"At {_name(first, content['drive_unit'])}, where they differ most, it leaves {one} rms "
        f"before and {two} after.",
        f"By {_reference(content)}: the mean over the periods, less its own mean.",
        panels,
        Table(
            f"Rms of what is left, in {scale.unit}",
            ["drive", *_COLOURS, "difference"],
            [
                [_name(row, content["drive_unit"])]
                + [scale.bare(_rms(part)) for part in (row["before"], row["after"], diff)]
                for row, diff in zip(rows, map(_difference, rows), strict=True)
            ],
        ),
    )


def _reference(content: dict[str, Any]) -> str:
    return content["gap"]["reference"] if content["gap"] else "one model"


def _name(row: dict[str, Any], drive_unit: str) -> str:
    rate = format_setting(row["excitation_hz"], "Hz")
    return f"{rate}, swing {format_setting(row['amplitude'], unit_text(drive_unit))}"


def _difference(row: dict[str, Any]) -> list[float | None]:
    pairs = zip(*(finite_values(row[name]) for name in _COLOURS), strict=True)
    return [None if a is None or b is None else b - a for a, b in pairs]


def _rms(values: list[float | None]) -> float:
    known = [v for v in finite_values(values) if v is not None]
    return math.sqrt(sum(v * v for v in known) / len(known)) if known else 0.0
