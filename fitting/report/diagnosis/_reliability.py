"""How often answers of a given probability were right, on devices whose answer was known."""

from typing import Any

from scipy import stats

from fitting.report.charts._figure import Table

from ._numbers import finite_or_none


def tabulate_reliability(diagnosis: dict) -> Table | None:
    """A row per bin of probability; `None` where the file has none."""
    found = (diagnosis.get("calibration") or {}).get("reliability") or []
    rows = [row for row in map(_row, found) if row]
    if not rows:
        return None
    return Table(
        "How often verdicts of a given probability were right, on simulated devices",
        ["mean probability", "verdicts", "right", "95 % interval"],
        rows,
    )


def _row(part: Any) -> list[str]:
    if not isinstance(part, dict):
        return []
    count, said, right = (finite_or_none(part.get(k)) for k in ("n", "confidence", "right"))
    if not count or said is None or right is None:
        return []
    interval = stats.binomtest(round(right * count), round(count)).proportion_ci(method="wilson")
    between = f"{100.0 * interval.low:.0f} to {100.0 * interval.high:.0f} %"
    return [f"{100.0 * said:.1f} %", f"{count:.0f}", f"{100.0 * right:.0f} %", between]
