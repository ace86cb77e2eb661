"""The gap by harmonic of the scan."""

import math
from typing import Any

from fitting.report.diagnosis._numbers import Scale, format_number

from ._figure import Figure, Panel, Table, escape_text, finite_values, make_axis, make_layout
from ._rows import sort_by_rate
from ._traces import SEQUENTIAL, make_colour_bar, make_row_axis, map_height


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
    ticks = [float(k) for k in range(math.ceil(low), math.floor(high) + 1)]
    bar = make_colour_bar(scale.unit, ticks, [format_number(10.0**k, 1) for k in ticks])
    heat = {
        "type": "heatmap",
        "x": orders,
        "y": list(range(len(entries))),
        "z": [
            [
                math.log10(row[n]["amplitude"]) if n in row and row[n]["amplitude"] else None
                for n in orders
            ]
            for row in cells
        ],
        "customdata": [
            [_write_hover(escape_text(labels[i]), n, row.get(n), scale) for n in orders]
            for i, row in enumerate(cells)
        ],
        "hovertemplate": "%{customdata}<extra></extra>",
        "hoverongaps": False,
        "colorscale": SEQUENTIAL,
        "zmin": low,
        "zmax": high,
        "ygap": 2,
        "colorbar": bar,
    }
    above = [(n, i) for i, row in enumerate(cells) for n in row if row[n]["significant"]]
    dots = {
        "type": "scatter",
        "mode": "markers",
        "x": [n for n, _ in above],
        "y": [i for _, i in above],
        "marker": {
            "size": 5,
            "color": "var(--dot)",
            "line": {"width": 1, "color": "var(--ground)"},
        },
        "hoverinfo": "skip",
    }
    y = make_row_axis(labels)
    x = make_axis("", showline=False, range=[orders[0] - 0.5, orders[-1] + 0.5])
    largest, where = max(known, key=lambda item: item[0]["amplitude"])
    share = f"{len(above)} of {sum(map(len, cells))} stand above the noise floor"
    return Figure(
        "By harmonic of the scan",
        f"The largest harmonic, {format_number(largest['amplitude'])} {scale.unit}, is number "
        f"{largest['harmonic']} of the run at {labels[where]}; {share}.",
        "A dot marks an amplitude above the noise floor. Odd harmonics return with their sign "
        "turned half a period later, as a symmetric loop does; even ones return unchanged, as a "
        "curvature does.",
        [
            Panel(
                "harmonics",
                map_height(len(entries)),
                [heat, dots],
                make_layout(x, y),
                below="harmonic of the scan rate",
            )
        ],
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


def _write_hover(label: str, order: int, cell: dict | None, scale: Scale) -> str:
    if cell is None:
        return label
    unit = escape_text(scale.unit)
    text = f"{label}<br>harmonic {order}<br>{format_number(cell['amplitude'])} {unit}"
    return text + (f"<br>floor {format_number(cell['floor'])} {unit}" if cell["floor"] else "")
