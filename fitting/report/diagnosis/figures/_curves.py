"""The residual against time: since a turning point, and over the session."""

from fitting.report.charts._axis import make_axis, make_log_axis
from fitting.report.charts._curves import describe_points, draw_curve
from fitting.report.charts._figure import Figure, Panel, finite_values, ordered_colour
from fitting.report.diagnosis._numbers import Scale, finite_or_none, format_number, format_setting

from ._rows import find_peak, scale_values, sort_by_rate, tabulate_values


def draw_since_turn(found: dict, scale: Scale) -> Figure | None:
    """The mean residual after the low and after the high turning point, a curve a rate."""
    x = finite_values(found.get("seconds"))
    entries = sort_by_rate(found.get("rows") or [])
    rates = sorted(
        {r for r in (finite_or_none(e.get("excitation_hz")) for e in entries) if r is not None}
    )
    turns = list(dict.fromkeys(str(e.get("turn") or "") for e in entries))
    every = [scale_values(e.get("mean"), scale) for e in entries]
    rows = [
        (
            f"{e.get('turn') or 'either'} turn at {format_setting(e.get('excitation_hz'), 'Hz')}",
            values,
        )
        for e, values in zip(entries, every, strict=True)
    ]
    top = find_peak(x, rows)
    if top is None:
        return None
    steps = [b - a for a, b in zip(x, x[1:], strict=False) if a is not None and b is not None]
    # Bins that grow with time were made for a logarithmic axis.
    grows = steps and min(v for v in x if v is not None) > 0 and max(steps) > 3 * min(steps)
    shown = [None if v is None else 1e3 * v for v in x]
    x_title = "time since the turning point (ms)"
    x_axis = make_log_axis(x_title, shown) if grows else make_axis(x_title, shown)
    y_title = f"mean residual ({scale.unit})"
    y_axis = make_axis(y_title, [v for row in every for v in row], margin=0.08, zero=True)
    panels = []
    for turn in sorted(turns, key=lambda t: {"low": 0, "high": 1}.get(t, 2)):
        marks, legend = [], []
        for e, values in zip(entries, every, strict=True):
            rate = finite_or_none(e.get("excitation_hz"))
            if str(e.get("turn") or "") == turn:
                known = rate in rates
                colour = ordered_colour(rates.index(rate), len(rates)) if known else "var(--soft)"
                name = format_setting(rate, "Hz")
                texts = describe_points(name, shown, values, "ms", scale.unit)
                marks += draw_curve((x_axis, y_axis), shown, values, texts, colour)
                legend.append((name, colour))
        panels.append(
            Panel(
                f"turn-{len(panels)}",
                240,
                x_axis,
                y_axis,
                marks,
                f"After the {turn} turning point" if turn else "After a turning point",
                legend=legend if len(legend) > 1 else (),
            )
        )
    return Figure(
        "Since the turning point",
        f"After a turning point the mean residual is largest, {format_number(top[2], sign=True)} "
        f"{scale.unit}, {format_number(shown[top[1]])} ms after the {top[0]}.",
        "A lag or a ringing decays in the same time at every rate; hysteresis keeps its shape over "
        "the phase of the period.",
        panels,
        tabulate_values("Mean residual since the turning point", "ms", shown, rows, scale.unit),
    )


def draw_session(found: dict, scale: Scale) -> Figure | None:
    """The mean and the rms residual over the session's time."""
    x = finite_values(found.get("time_s"))
    mean, rms = scale_values(found.get("mean"), scale), scale_values(found.get("rms"), scale)
    top = find_peak(x, [("mean", mean), ("rms", rms)])
    if top is None:
        return None
    x_axis = make_axis("time in the session (s)", x)
    y_axis = make_axis(f"residual ({scale.unit})", [*mean, *rms], margin=0.08, zero=True)
    marks, legend = [], []
    for name, values, colour in (("rms", rms, "var(--soft)"), ("mean", mean, "var(--accent)")):
        if any(v is not None for v in values):
            texts = describe_points(name, x, values, "s", scale.unit)
            marks += draw_curve((x_axis, y_axis), x, values, texts, colour)
            legend.append((name, colour))
    middle = [v for v in mean if v is not None]
    shows = f"Over the session the {top[0]} residual is largest, {format_number(top[2])} "
    shows += f"{scale.unit}, at {format_number(x[top[1]])} s"
    if len(middle) > 1:
        shows += f"; the mean goes from {format_number(middle[0], sign=True)} to "
        shows += f"{format_number(middle[-1], sign=True)} {scale.unit}"
    return Figure(
        "Over the session",
        shows + ".",
        "A mean that changes is drift; an rms that grows while the mean does not is a change of "
        "the gain or of the noise.",
        [Panel("session", 220, x_axis, y_axis, marks, legend=legend)],
        tabulate_values(
            "Residual by session time", "s", x, [("mean", mean), ("rms", rms)], scale.unit
        ),
    )
