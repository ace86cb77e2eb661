"""The gap by harmonic of the scan."""

import dataclasses
import math
from typing import Any

from fitting.report.charts._axis import make_axis
from fitting.report.charts._figure import ColourScale, Figure, Table, finite_values, shorten
from fitting.report.charts._heatmap import make_map
from fitting.report.charts._marks import plain_level
from fitting.report.diagnosis._numbers import Scale, format_number, format_quantity

from ._rows import sort_by_rate


def draw_harmonics(found: dict, scale: Scale, runs: dict[Any, dict]) -> Figure | None:
    """Amplitude by harmonic and run, in decades of colour; a dot where it stands above noise."""
    rows = {e.get("run"): e for e in found.get("rows") or []}
    entries = [rows[run["run"]] for run in sort_by_rate(list(runs.values())) if run["run"] in rows]
    cells = [_cells_by_order(e, scale) for e in entries]
    known = [(cell, i) for i, row in enumerate(cells) for cell in row.values() if cell["amplitude"]]
    if not known:
        return None
    labels = [runs[e.get("run")]["label"] for e in entries]
    orders = sorted({n for row in cells for n in row})
    decades = [math.log10(cell["amplitude"]) for cell, _ in known]
    low, high = min(decades), max(decades)
    # Two decades at least: harmonics of about one size must not look unlike.
    low = min(low, high - 2.0)
    levels = {
        (i, n): plain_level((math.log10(cell["amplitude"]) - low) / (high - low))
        for i, row in enumerate(cells)
        for n, cell in row.items()
        if cell["amplitude"]
    }
    cells_drawn = [
        (i, n - 0.5, n + 0.5, level, _describe_cell(labels[i], n, cells[i][n], scale))
        for (i, n), level in levels.items()
    ]
    above = [
        (float(n), i, levels.get((i, n), ""))
        for i, row in enumerate(cells)
        for n in row
        if row[n]["significant"]
    ]
    axis = make_axis("harmonic of the scan rate", [], ends=(orders[0] - 0.5, orders[-1] + 0.5))
    axis = dataclasses.replace(axis, ticks=[t for t in axis.ticks if t[0] in orders])
    ends = [format_quantity(10.0**k, scale.unit, digits=2) for k in (low, high)]
    colours = ColourScale("plain-scale", ends[0], f"{ends[1]}, logarithmic")
    named = [shorten(label) for label in labels]
    panel = make_map("harmonics", axis, cells_drawn, named, colours, above)
    largest, where = max(known, key=lambda item: item[0]["amplitude"])
    share = f"{len(above)} of {sum(map(len, cells))} stand above the noise floor"
    return Figure(
        "By harmonic of the scan",
        f"The largest harmonic, {format_number(largest['amplitude'])} {scale.unit}, is number "
        f"{largest['harmonic']} of the run at {labels[where]}; {share}.",
        "A dot marks an amplitude above the noise floor. A symmetric hysteresis loop has odd "
        "harmonics alone; even ones come from a curvature.",
        [panel],
        Table(
            f"Harmonics, in {scale.unit}",
            ["run", "harmonic", "amplitude", "floor", "above"],
            [
                [
                    labels[i],
                    str(n),
                    format_number(c["amplitude"]),
                    format_number(c["floor"]),
                    "yes" if c["significant"] else "no",
                ]
                for i, row in enumerate(cells)
                for n, c in row.items()
            ],
        ),
    )


def _cells_by_order(entry: dict, scale: Scale) -> dict[int, dict]:
    orders = finite_values(entry.get("harmonic"))
    amplitude = finite_values(entry.get("amplitude"))
    floor, flags = finite_values(entry.get("floor")), list(entry.get("significant") or [])
    pad = len(orders)
    columns = zip(
        orders,
        (amplitude + [None] * pad)[:pad],
        (floor + [None] * pad)[:pad],
        (flags + [False] * pad)[:pad],
        strict=True,
    )
    return {
        int(n): {
            "harmonic": int(n),
            # Not above zero: no colour on a scale of decades.
            "amplitude": scale.value(a) if a is not None and a > 0 else None,
            "floor": scale.value(f),
            "significant": bool(s),
        }
        for n, a, f, s in columns
        if n is not None
    }


def _describe_cell(label: str, order: int, cell: dict, scale: Scale) -> str:
    size = format_quantity(cell["amplitude"], scale.unit)
    text = f"{label}, harmonic {order}: {size}"
    floor = format_quantity(cell["floor"], scale.unit)
    return text + (f", noise floor {floor}" if cell["floor"] else "")
