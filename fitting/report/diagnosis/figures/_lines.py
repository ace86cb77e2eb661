"""Lines in the spectrum of the residual, scan-synchronous or not."""

from typing import Any

from fitting.report.charts._figure import Figure, Table
from fitting.report.diagnosis._numbers import Scale, finite_or_none, format_number, format_setting


def tabulate_spectral_lines(found: Any, scale: Scale) -> Figure | None:
    """Lines of the spectrum with amplitude, p-value, and whether they are scan-synchronous."""
    entries = [e for e in found or [] if isinstance(e, dict)]
    if not entries:
        return None
    rows = [
        [
            format_setting(e.get("hz"), "Hz"),
            scale(e.get("amplitude")),
            format_number(e.get("p_value"), 2),
            "" if e.get("locked") is None else "yes" if e["locked"] else "no",
        ]
        for e in entries
    ]
    top = max(entries, key=lambda e: finite_or_none(e.get("amplitude")) or 0.0)
    return Figure(
        "Lines in the spectrum",
        f"The strongest line of the residual is at {format_setting(top.get('hz'), 'Hz')}, "
        f"{scale(top.get('amplitude'))}.",
        "A line that is not scan-synchronous is fixed in time, as pickup is. The p-value is the "
        "probability of a line this strong in noise alone.",
        [],
        Table(
            f"The {len(rows)} strongest lines",
            ["line", "amplitude", "p-value", "scan-synchronous"],
            rows,
        ),
    )
