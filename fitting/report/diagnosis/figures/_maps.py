"""Heat maps of the mean residual: by phase and run, and by response and run."""

from typing import Any

from fitting.report.charts._axis import make_axis
from fitting.report.charts._figure import Figure, finite_values
from fitting.report.charts._heatmap import draw_heatmap
from fitting.report.diagnosis._numbers import Scale, format_number

from ._curves import draw_session, draw_since_turn
from ._harmonics import draw_harmonics
from ._rows import find_peak, label_runs, scale_values, sort_by_rate, tabulate_values


def draw_figures(diagnosis: dict, scale: Scale, drive_unit: str) -> list[Figure]:
    """One figure for each map of the file that holds a number."""
    maps = diagnosis.get("maps") or {}
    runs = label_runs(diagnosis, drive_unit)
    made = [
        draw_phase(maps.get("phase") or {}, scale, runs),
        draw_since_turn(maps.get("since_turn") or {}, scale),
        draw_frequency(maps.get("frequency") or {}, scale, runs),
        draw_session(maps.get("session") or {}, scale),
        draw_harmonics(maps.get("harmonics") or {}, scale, runs),
    ]
    return [figure for figure in made if figure is not None]


def draw_phase(found: dict, scale: Scale, runs: dict[Any, dict]) -> Figure | None:
    """The mean residual over the phase of the drive and the runs, by rate."""
    x = finite_values(found.get("phase"))
    entries = sort_by_rate(found.get("rows") or [])
    named = [runs[e.get("run")]["label"] for e in entries]
    rows = [
        (name, scale_values(e.get("mean"), scale)) for name, e in zip(named, entries, strict=True)
    ]
    top = find_peak(x, rows)
    if top is None:
        return None
    errors = [scale_values(e.get("stderr"), scale) for e in entries]
    texts = [
        [f"standard error {format_number(s[j])}" if j < len(s) else "" for j in range(len(row))]
        for (_, row), s in zip(rows, errors, strict=True)
    ]
    error = errors[named.index(top[0])]
    against = error[top[1]] if top[1] < len(error) else None
    sure = f"; that is {abs(top[2]) / against:.0f} standard errors" if against else ""
    title = "phase of the period, from the drive's minimum"
    panel = draw_heatmap(
        "phase",
        x,
        rows,
        title=title,
        unit=scale.unit,
        x_name="phase",
        axis=make_axis(title, [], ends=(0.0, 1.0), ticks=(0.0, 0.25, 0.5, 0.75, 1.0)),
        texts=texts if any(errors) else None,
    )
    return Figure(
        "Over phase and rate",
        f"The mean residual is largest, {format_number(top[2], sign=True)} {scale.unit}, "
        f"at phase {x[top[1]] or 0.0:.2f} of the run at {top[0]}{sure}.",
        "Each row is a run, from slow to fast. A symmetric triangle has its turning points at 0 "
        "and 0.5.",
        [panel],
        tabulate_values("Mean residual by phase", "phase", x, rows, scale.unit),
    )


def draw_frequency(found: dict, scale: Scale, runs: dict[Any, dict]) -> Figure | None:
    """The mean residual over the response itself, a row per run and direction."""
    x = finite_values(found.get("nu"))
    entries = sort_by_rate([runs[e.get("run")] | e for e in found.get("rows") or []])
    names = [f"{e['label']} {e.get('direction') or ''}".strip() for e in entries]
    rows = [
        (name, scale_values(e.get("mean"), scale)) for name, e in zip(names, entries, strict=True)
    ]
    top = find_peak(x, rows)
    if top is None:
        return None
    optical = scale.recorded.endswith("Hz")
    quantity = "optical frequency" if optical else "response"
    panel = draw_heatmap(
        "frequency",
        x,
        rows,
        title=f"{quantity} ({scale.axis})",
        unit=scale.unit,
        x_name=quantity,
    )
    return Figure(
        f"Over {quantity}",
        f"The mean residual is largest, {format_number(top[2], sign=True)} {scale.unit}, "
        f"at {format_number(x[top[1]])} {scale.axis} of the run at {top[0]}.",
        f"A column of one colour through all rows depends on the {quantity} alone"
        f"{', as an etalon does' if optical else ''}.",
        [panel],
        tabulate_values(f"Mean residual by {quantity}", scale.axis, x, rows, scale.unit),
    )
