"""Where the gap lies in time: since a turning point, and over the session."""

from fitting.report.diagnosis._numbers import Scale, finite, number, setting

from ._figure import Figure, Panel, axis, finites, layout, safe
from ._rows import by_rate, peak, scaled, values_table
from ._traces import decades, line, shade, span


def since_turn(found: dict, scale: Scale) -> Figure | None:
    """The mean residual after the low and after the high turning point, a curve a rate."""
    x = finites(found.get("seconds"))
    entries = by_rate(found.get("rows") or [])
    rates = sorted({r for r in (finite(e.get("excitation_hz")) for e in entries) if r is not None})
    turns = list(dict.fromkeys(str(e.get("turn") or "") for e in entries))
    every = [scaled(e.get("mean"), scale) for e in entries]
    rows = [
        (f"{e.get('turn') or 'either'} turn at {setting(e.get('excitation_hz'), 'Hz')}", values)
        for e, values in zip(entries, every, strict=True)
    ]
    top = peak(x, rows)
    if top is None:
        return None
    low, high = span([v for row in every for v in row])
    steps = [b - a for a, b in zip(x, x[1:], strict=False) if a is not None and b is not None]
    # Bins that grow with time were made for a logarithmic axis.
    grows = steps and min(v for v in x if v is not None) > 0 and max(steps) > 3 * min(steps)
    shown = [None if v is None else 1e3 * v for v in x]
    panels = []
    for turn in sorted(turns, key=lambda t: {"low": 0, "high": 1}.get(t, 2)):
        curves = []
        for e, values in zip(entries, every, strict=True):
            rate = finite(e.get("excitation_hz"))
            if str(e.get("turn") or "") == turn:
                color = shade(rates.index(rate), len(rates)) if rate in rates else "var(--soft)"
                name = setting(rate, "Hz")
                curves.append(
                    line(shown, values, name=name, color=color, hover="ms", unit=scale.unit)
                )
        x_axis = axis("time since the turning point (ms)", **(decades(shown) if grows else {}))
        y_axis = axis(
            f"mean residual ({safe(scale.unit)})",
            range=[low, high],
            zeroline=True,
            zerolinecolor="var(--rule)",
        )
        panels.append(
            Panel(
                f"turn-{len(panels)}",
                280,
                curves,
                layout(x_axis, y_axis, showlegend=len(curves) > 1),
                f"After the {turn} turning point" if turn else "After a turning point",
            )
        )
    return Figure(
        "Since the turning point",
        f"After a turning point the mean residual is largest, {number(top[2], sign=True)} "
        f"{scale.unit}, {number(shown[top[1]])} ms after the {top[0]}.",
        "What decays in the same time at every rate is a lag or a ringing; what keeps its shape "
        "in phase is hysteresis.",
        panels,
        values_table("Mean residual since the turning point", "ms", shown, rows, scale.unit),
    )


def session(found: dict, scale: Scale) -> Figure | None:
    """The mean and the rms residual over the session's time."""
    x = finites(found.get("time_s"))
    mean, rms = scaled(found.get("mean"), scale), scaled(found.get("rms"), scale)
    top = peak(x, [("mean", mean), ("rms", rms)])
    if top is None:
        return None
    curves = [
        line(x, values, name=name, color=color, hover="s", unit=scale.unit)
        for name, values, color in (("rms", rms, "var(--soft)"), ("mean", mean, "var(--accent)"))
        if any(v is not None for v in values)
    ]
    y = axis(
        f"residual ({safe(scale.unit)})",
        range=span([*mean, *rms]),
        zeroline=True,
        zerolinecolor="var(--rule)",
    )
    middle = [v for v in mean if v is not None]
    shows = f"Over the session the {top[0]} residual is largest, {number(top[2])} "
    shows += f"{scale.unit}, at {number(x[top[1]])} s"
    if len(middle) > 1:
        shows += f"; the mean goes from {number(middle[0], sign=True)} to "
        shows += f"{number(middle[-1], sign=True)} {scale.unit}"
    return Figure(
        "Over the session's time",
        shows + ".",
        "A slope or a wander of the mean is drift; an rms that grows about a still mean is a gain "
        "that changes, or noise that does.",
        [Panel("session", 260, curves, layout(axis("time (s)"), y, showlegend=True))],
        values_table(
            "Residual by session time", "s", x, [("mean", mean), ("rms", rms)], scale.unit
        ),
    )
