"""What a recording would have shown: the smallest size of each effect that is not named."""

from typing import Any

from fitting.report.charts._figure import Table

from . import _text as words
from ._numbers import DASH, Scale, format_quantity
from ._which import name_field


def tabulate_detectability(diagnosis: dict, labels: words.Labels, scale: Scale) -> Table | None:
    """A row an effect; `None` where the file has none."""
    found = [e for e in diagnosis.get("detectability") or [] if isinstance(e, dict)]
    if not found:
        return None
    rows = []
    for entry in found:
        size, kind = describe_size(entry, scale)
        name = words.describe_hypothesis(str(entry.get("effect") or "?"), labels)
        rows.append([words.capitalise(name), size, kind or DASH])
    return Table(
        "Smallest detectable size of each effect", ["effect", "smallest size", "for"], rows
    )


def describe_size(entry: dict[str, Any], scale: Scale) -> tuple[str, str]:
    """The size, with its parameter, and the kind of effect that it is for."""
    value, unit = scale.convert(entry.get("value"), str(entry.get("unit") or ""))
    name = name_field(str(entry.get("parameter") or ""))
    size = (
        "not detectable at any size" if value is None else f"{name} {format_quantity(value, unit)}"
    )
    others = [
        f"{name_field(key)} "
        + format_quantity(*scale.convert(p.get("value"), str(p.get("unit") or "")))
        for key, p in (entry.get("others") or {}).items()
        if isinstance(p, dict) and p.get("value") and key != "phase"
    ]
    return size, ", ".join(others) if value is not None else ""
