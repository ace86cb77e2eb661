"""Lines in the spectrum of the residual, locked to the scan or not."""

from typing import Any

from fitting.report.diagnosis._numbers import Scale, finite, number, setting

from ._figure import Figure, Table


def lines(found: Any, scale: Scale) -> Figure | None:
    """Lines of the spectrum, with whether they are locked to the scan."""
    entries = [e for e in found or [] if isinstance(e, dict)]
    if not entries:
        return None
    rows = [
        [
            setting(e.get("hz"), "Hz"),
            scale(e.get("amplitude")),
            number(e.get("p_value"), 2),
            "" if e.get("locked") is None else "yes" if e["locked"] else "no",
        ]
        for e in entries
    ]
    top = max(entries, key=lambda e: finite(e.get("amplitude")) or 0.0)
    return Figure(
        "Lines in the spectrum",
        f"The strongest line of the residual is at {setting(top.get('hz'), 'Hz')}, "
        f"{scale(top.get('amplitude'))}.",
        "A line that is not locked to the scan is fixed in time, as pickup is. The last but one "
        "column is the chance of so strong a line in noise alone.",
        [],
        Table("Lines", ["line", "amplitude", "chance in noise", "locked"], rows),
    )
