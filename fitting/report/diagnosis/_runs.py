"""Which runs carry the verdict: residual without and with the named effects, by run."""

from typing import Any

from fitting.report.charts._figure import Table

from . import _text as words
from ._numbers import Scale, finite_or_none, format_percent


def tabulate_runs(shrinkage: dict[str, Any], scale: Scale, drive_unit: str) -> Table | None:
    """A row per run, the one that says most first; `None` where no effect is named."""
    found = [e for e in shrinkage.get("by_run") or [] if isinstance(e, dict)]
    found = [e for e in found if finite_or_none(e.get("share")) is not None]
    if not found:
        return None
    rows = [
        [
            words.label_run(e, drive_unit),
            scale.bare(e.get("before")),
            scale.bare(e.get("after")),
            format_percent(e["share"]),
        ]
        for e in found
    ]
    first = words.label_run(found[0], drive_unit)
    caption = f"Evidence by run: the run at {first} gives {format_percent(found[0]['share'])} of it"
    head = [
        "run",
        f"without, {scale.unit}",
        f"with the effect, {scale.unit}",
        "share of the evidence",
    ]
    return Table(caption, head, rows)
