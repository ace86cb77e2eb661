"""How far the gap shrinks on data left out, and what to record next."""

from typing import Any

from . import _text as words
from ._numbers import Scale, finite, interval, number, percent
from .figures._figure import Table

_STEPS = {"before": "model alone", "after": "model refitted", "floor": "noise floor"}


def shrinkage(found: dict, scale: Scale, named: bool) -> dict[str, Any] | None:
    """Before, after and floor as bars; the parts left out; None where nothing was refitted.

    `named` says whether the refit had an effect to add.
    """
    steps = _STEPS | ({"after": "with the effect"} if named else {})
    values = {key: finite(found.get(key)) for key in steps}
    if values["before"] is None:
        return None
    largest = max(v for v in values.values() if v is not None)
    parts = [p for p in found.get("by_part") or [] if isinstance(p, dict)]
    lowest = [finite((p.get("closed_fraction") or {}).get("low")) for p in parts]
    start = max(-1.0, min([0.0, *(v for v in lowest if v is not None)]))
    return {
        "bars": [
            {
                "key": key,
                "name": name,
                "value": "not known" if values[key] is None else scale(values[key]),
                "width": (values[key] or 0.0) / largest if largest > 0 else 0.0,
            }
            for key, name in steps.items()
        ],
        "shows": _shows(found, values, scale),
        "parts": [_part(p, start, scale) for p in parts],
        "parts_shows": _spread(parts),
        "zero": -start / (1.0 - start),
        "low": percent(start),
        "held_out": words.listed([str(name) for name in found.get("held_out") or []]),
        "ceiling": "" if finite(found.get("ceiling")) is None else percent(found["ceiling"]),
        "remainder": words.sentence(str(found.get("remainder") or "")),
        "unit": scale.unit,
    }


def _shows(found: dict, values: dict[str, float | None], scale: Scale) -> str:
    if values["after"] is None:
        return f"The model alone leaves {scale(values['before'])} rms on data left out."
    text = f"The residual on data left out goes from {scale(values['before'])} to "
    text += f"{scale(values['after'])} rms"
    closed = found.get("closed_fraction")
    if not isinstance(closed, dict) and values["floor"] is None:
        return f"{text}. How much of that is noise is not known."
    if not isinstance(closed, dict):
        return f"{text}. There was no gap above the noise to close."
    return f"{text}: {interval(closed)} of the gap above the noise is closed."


def _spread(parts: list[dict]) -> str:
    known = [
        (value, str(p.get("part") or "?"))
        for p in parts
        if (value := finite((p.get("closed_fraction") or {}).get("value"))) is not None
    ]
    if not known:
        return "No part left out had a gap to close."
    (least, where), most = min(known), max(known)[0]
    if len(known) == 1:
        return f"On {where}, {percent(least)} of the gap is closed."
    return f"The gap closed is least on {where}, {percent(least)}, and at most {percent(most)}."


def _part(p: dict, start: float, scale: Scale) -> dict[str, Any]:
    return {
        "name": str(p.get("part") or "?"),
        "before": scale.bare(p.get("before")),
        "after": scale.bare(p.get("after")),
        "closed": interval(p.get("closed_fraction")),
        "whisker": _whisker(p.get("closed_fraction"), start),
    }


def _whisker(fraction: Any, start: float) -> dict[str, float] | None:
    """Places along a rail from `start` to 1, as fractions of its length."""
    f = fraction if isinstance(fraction, dict) else {}
    value = finite(f.get("value"))
    if value is None:
        return None
    low, high = finite(f.get("low")), finite(f.get("high"))
    ends = {"value": value, "low": value if low is None else low}
    ends["high"] = value if high is None else high
    return {k: min(1.0, max(0.0, (v - start) / (1.0 - start))) for k, v in ends.items()}


def following(found: dict | None, drive_unit: str, labels: words.Labels) -> dict[str, Any] | None:
    """The scan to record next, why, and what else was considered."""
    if not found:
        return None
    entries = [c for c in found.get("candidates") or [] if isinstance(c, dict)]
    entries.sort(key=lambda c: -(finite(c.get("power")) or 0.0))
    rows = [[words.scan(c, drive_unit), number(c.get("power"))] for c in entries]
    return {
        "scan": words.title(words.scan(found, drive_unit)),
        "separates": words.separated(found, labels),
        "reason": words.sentence(str(found.get("reason") or "")),
        "table": Table("Scans considered", ["scan", "power to separate"], rows)
        if rows[1:]
        else None,
    }
