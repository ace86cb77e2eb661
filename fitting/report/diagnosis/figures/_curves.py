"""The residual against time: since a turning point, and over the session."""

from fitting.report.diagnosis._numbers import Scale, finite_or_none, format_number, format_setting

from ._figure import Figure, Panel, escape_text, finite_values, make_axis, make_layout
from ._rows import find_peak, scale_values, sort_by_rate, tabulate_values
from ._traces import axis_range, draw_curve, make_log_axis, ordered_colour


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
    low, high = axis_range([v for row in every for v in row])
    steps = [b - a for a, b in zip(x, x[1:], strict=False) if a is not None and b is not None]
    # Bins that grow with time were made for a logarithmic axis.
    grows = steps and min(v for v in x if v is not None) > 0 and max(steps) > 3 * min(steps)
    shown = [None if v is None else 1e3 * v for v in x]
    panels = []
    for turn in sorted(turns, key=lambda t: {"low": 0, "high": 1}.get(t, 2)):
        curves = []
        for e, values in zip(entries, every, strict=True):
            rate = finite_or_none(e.get("excitation_hz"))
            if str(e.get("turn") or "") == turn:
                color = (
                    ordered_colour(rates.index(rate), len(rates))
                    if rate in rates
                    else "var(--soft)"
                )
                name = format_setting(rate, "Hz")
                curves.append(
                    draw_curve(shown, values, name=name, color=color, hover="ms", unit=scale.unit)
                )
        x_axis = make_axis(
            "time since the turning point (ms)", **(make_log_axis(shown) if grows else {})
        )
        y_axis = make_axis(
            f"mean residual ({escape_text(scale.unit)})",
            range=[low, high],
            zeroline=True,
            zerolinecolor="var(--rule)",
        )
        panels.append(
            Panel(
                f"turn-{len(panels)}",
                280,
                curves,
                make_layout(x_axis, y_axis, showlegend=len(curves) > 1),
                f"After the {turn} turning point" if turn else "After a turning point",
            )
        )
    return Figure(
        "Since the turning point",
        f"After a turning point the mean residual is largest, {format_number(top[2], sign=True)} "
        f"{scale.unit}, {format_number(shown[top[1]])} ms after the {top[0]}.",
        "What decays in the same time at every rate is a lag or a ringing; what keeps its shape "
        "in phase is hysteresis.",
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
    curves = [
        draw_curve(x, values, name=name, color=color, hover="s", unit=scale.unit)
        for name, values, color in (("rms", rms, "var(--soft)"), ("mean", mean, "var(--accent)"))
        if any(v is not None for v in values)
    ]
    y = make_axis(
        f"residual ({escape_text(scale.unit)})",
        range=axis_range([*mean, *rms]),
        zeroline=True,
        zerolinecolor="var(--rule)",
    )
    middle = [v for v in mean if v is not None]
    shows = f"Over the session the {top[0]} residual is largest, {format_number(top[2])} "
    shows += f"{scale.unit}, at {format_number(x[top[1]])} s"
    if len(middle) > 1:
        shows += f"; the mean goes from {format_number(middle[0], sign=True)} to "
        shows += f"{format_number(middle[-1], sign=True)} {scale.unit}"
    return Figure(
        "Over the session's time",
        shows + ".",
        "A slope or a wander of the mean is drift; an rms that grows about a still mean is a gain "
        "that changes, or noise that does.",
        [Panel("session", 260, curves, make_layout(make_axis("time (s)"), y, showlegend=True))],
        tabulate_values(
            "Residual by session time", "s", x, [("mean", mean), ("rms", rms)], scale.unit
        ),
    )
