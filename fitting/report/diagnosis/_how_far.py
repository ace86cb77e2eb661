"""The closed fraction of the gap on held-out data, and the next scan to record."""

from typing import Any

from fitting.report.charts._figure import Table

from . import _text as words
from ._numbers import Scale, finite_or_none, format_interval, format_percent

_STEPS = {"before": "model alone", "after": "model refitted", "floor": "noise floor"}
_FITTED = {"after": "with the effect"}
_HELD_OUT = {"before": "held out, without the effect", "after": "held out, with the effect"}
_UNNAMED = "No known effect is named, so none is added."
_NOTHING_EXCEEDS = "It does not exceed the noise: there is no gap to close"


def tabulate_shrinkage(
    found: dict, scale: Scale, name: str, *, judged: bool = True, richer: dict | None = None
) -> dict[str, Any] | None:
    """Residual before and after the refit and noise floor as bars, and by held-out part; or None.

    `name`: of the verdict; `judged`: whether the device was judged at all. `richer`: the model with
    more plays that explains the gap where no effect does, its `plays` and what it leaves, `rms`.
    """
    steps = _STEPS | ({} if name == "none" else _HELD_OUT if found.get("held_out") else _FITTED)
    if name == "unlisted":
        steps["after"] = "with the best known effect"
    if not found.get("held_out") or (name == "unlisted" and found.get("closed_fraction") is None):
        del steps["after"]  # no effect was added, or nothing tells what it would leave
    after = "after" in steps
    values = {key: finite_or_none(found.get(key)) for key in steps}
    if richer:
        plays = richer.get("plays")
        steps = _STEPS | {"before": "identified model", "after": f"with {plays} plays"}
        values |= {"after": finite_or_none(richer.get("rms"))}
    if values["before"] is None:
        return None
    largest = max(v for v in values.values() if v is not None)
    parts = [p for p in found.get("by_part") or [] if isinstance(p, dict)]
    lowest = [finite_or_none((p.get("closed_fraction") or {}).get("low")) for p in parts]
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
        "shows": _summarise_richer(values, richer, scale)
        if richer
        else _summarise_refit(found, values, scale, name, judged),
        "parts": [_tabulate_part(p, start, scale) for p in parts],
        "parts_shows": _summarise_parts(parts, name),
        "zero": -start / (1.0 - start),
        "low": format_percent(start),
        "held_out": words.join_items([str(name) for name in found.get("held_out") or []]),
        # Without an effect that is added all of it is what remains, and is told above.
        "remainder": words.to_sentence(str(found.get("remainder") or "") if after else ""),
        "unit": scale.unit,
    }


def _summarise_richer(values: dict[str, float | None], richer: dict, scale: Scale) -> str:
    return (
        f"The identified model leaves a residual of {scale(values['before'])} rms. No effect is "
        f"needed: with {richer.get('plays')} plays, in the model of this diagnosis, "
        f"{scale(values['after'])} rms are left."
    )


def _summarise_refit(
    found: dict, values: dict[str, float | None], scale: Scale, name: str, judged: bool
) -> str:
    alone = f"The model alone leaves a residual of {scale(values['before'])} rms"
    if not found.get("held_out"):
        if name == "none" and values["floor"] is not None:
            return f"{alone}. {_NOTHING_EXCEEDS}."
        return f"{alone}." + (f" {_UNNAMED}" if name == "unlisted" and judged else "")
    alone += " on held-out data"
    closed = found.get("closed_fraction")
    if name == "unlisted" and not isinstance(closed, dict):
        return f"{alone}." + (f" {_UNNAMED}" if judged else "")
    if values.get("after") is None:
        return f"{alone}."
    text = f"The residual on held-out data goes from {scale(values['before'])} to "
    text += f"{scale(values['after'])} rms"
    if isinstance(closed, dict):
        share = f"{text}: {format_interval(closed)} of the gap above the noise is closed"
        return f"{share}, too little to name that effect." if name == "unlisted" else f"{share}."
    if values["floor"] is None:
        return f"{text}. How much of that is noise is not known."
    return f"{text}. {_NOTHING_EXCEEDS if name == 'none' else 'The closed fraction is not known'}."


def _summarise_parts(parts: list[dict], name: str) -> str:
    known = [
        (value, str(p.get("part") or "?"))
        for p in parts
        if (value := finite_or_none((p.get("closed_fraction") or {}).get("value"))) is not None
    ]
    if not known and any(p.get("determined") is False for p in parts):
        return "Without any of these parts the other data do not determine the model."
    if not known:
        return "No part has a gap above the noise." if name == "none" else ""
    (least, where), most = min(known), max(known)[0]
    if len(known) == 1:
        return f"With {where} left out, {format_percent(least)} of the gap there is closed."
    lowest, highest = format_percent(least), format_percent(most)
    return f"The closed fraction is smallest for {where}, {lowest}; the largest is {highest}."


def _tabulate_part(p: dict, start: float, scale: Scale) -> dict[str, Any]:
    return {
        "name": str(p.get("part") or "?"),
        "before": scale.bare(p.get("before")),
        "after": scale.bare(p.get("after")),
        "closed": "the rest does not determine the model"
        if p.get("determined") is False
        else format_interval(p.get("closed_fraction")),
        "whisker": _place_interval(p.get("closed_fraction"), start),
    }


def _place_interval(fraction: Any, start: float) -> dict[str, float] | None:
    """Value and interval as fractions of an axis from `start` to 1."""
    f = fraction if isinstance(fraction, dict) else {}
    value = finite_or_none(f.get("value"))
    if value is None:
        return None
    low, high = finite_or_none(f.get("low")), finite_or_none(f.get("high"))
    ends = {"value": value, "low": value if low is None else low}
    ends["high"] = value if high is None else high
    return {k: min(1.0, max(0.0, (v - start) / (1.0 - start))) for k, v in ends.items()}


def _left(scan: dict) -> float | None:
    """The probability that a scan leaves to the wrong one of the two answers it separates least."""
    return finite_or_none(scan.get("left"))


def describe_next_scan(
    found: dict | None, drive_unit: str, labels: words.Labels
) -> dict[str, Any] | None:
    """The next scan to record, the reason, and the scans considered."""
    if not found:
        return None
    entries = [c for c in found.get("candidates") or [] if isinstance(c, dict)]
    entries.sort(key=lambda c: 1.0 if (left := _left(c)) is None else left)
    rows = [[words.describe_scan(c, drive_unit), format_percent(_left(c))] for c in entries]
    head = ["scan", "probability left to the wrong hypothesis"]
    return {
        "scan": words.capitalise(words.describe_scan(found, drive_unit)),
        "separates": words.describe_separation(found, labels),
        "reason": words.to_sentence(str(found.get("reason") or "")),
        "table": Table("Scans considered", head, rows) if rows[1:] else None,
    }
