"""What the gap is made of, and how it divides over runs, directions and regions."""

from typing import Any

from . import _text as words
from ._numbers import Scale, finite, percent
from .figures._rows import by_rate

_PARTS = (
    ("structural", "needs an effect"),
    ("parametric", "goes when the model is refitted"),
    ("noise_floor", "noise, which nothing removes"),
)


def budget(gap: dict, scale: Scale) -> dict[str, Any] | None:
    """Parts of the mean-square gap with their shares, and what they show; None without a gap."""
    rms = {key: finite(gap.get(key)) for key, _ in _PARTS}
    # A part that its estimate puts below zero takes no room.
    squares = {key: max(v, 0.0) ** 2 for key, v in rms.items() if v is not None}
    whole = finite(gap.get("total"))
    if whole is None and not squares:
        return None
    # Parts that are not known leave their room empty.
    total = max(sum(squares.values()), (whole or 0.0) ** 2)
    shares = {key: v / total for key, v in squares.items() if total}
    parts = [
        {
            "key": key.replace("_", "-"),
            "name": name,
            "rms": "not known" if rms[key] is None else scale(rms[key]),
            "share": shares.get(key, 0.0),
            "percent": percent(shares.get(key)),
        }
        for key, name in _PARTS
    ]
    shows = f"Model and recording differ by {scale(gap.get('total'))} rms"
    if "structural" in shares and "noise_floor" in shares:
        shows += f"; {percent(shares['structural'])} of the mean square needs an effect"
    return {"parts": parts, "shows": f"{shows}.", "locked": locked(gap, scale)}


def locked(gap: dict, scale: Scale) -> str:
    """How the gap divides between what the scan repeats and what it does not."""
    said = (("locked", "repeats with the scan"), ("not_locked", "does not"))
    # Estimates of a mean square less its noise: at or below zero there is nothing to see.
    parts = [
        f"what {text} is {scale(value) + ' rms' if value > 0 else 'nothing'}"
        for key, text in said
        if (value := finite(gap.get(key))) is not None
    ]
    return f"Above the noise, {words.listed(parts)}." if parts else ""


def grid(where: list[dict], scale: Scale, drive_unit: str) -> dict[str, Any] | None:
    """Residuals by run (down) and by direction and region (across), each with its share."""
    if not where:
        return None
    columns = list(dict.fromkeys(_place(e) for e in where))
    columns.sort(key=lambda place: {"up": 0, "down": 1}.get(place[0], 2))
    largest = max((finite(e.get("share")) or 0.0 for e in where), default=0.0)
    rows: dict[Any, dict[str, Any]] = {}
    for e in by_rate(where):
        scan = words.run_label(e, drive_unit)
        name = words.run_name(e)
        row = rows.setdefault(
            e.get("run"),
            {"scan": scan, "name": "" if name == scan else name, "cells": [None] * len(columns)},
        )
        row["cells"][columns.index(_place(e))] = _cell(e, largest, scale)
    shows = ""
    if largest > 0:
        top = max(where, key=lambda e: finite(e.get("share")) or 0.0)
        direction, region = _place(top)
        shows = (
            f"The largest share of the gap, {percent(top.get('share'))}, lies in the "
            f"{region} of the {direction} scan at {words.run_label(top, drive_unit)}: "
            f"{scale(top.get('rms'))} rms."
        )
    heads = [", ".join(filter(None, place)) for place in columns]
    return {"columns": heads, "rows": list(rows.values()), "shows": shows, "unit": scale.unit}


def _place(entry: dict) -> tuple[str, str]:
    return str(entry.get("direction") or ""), str(entry.get("region") or "")


def _cell(entry: dict, largest: float, scale: Scale) -> dict[str, Any]:
    share = finite(entry.get("share"))
    tint = max(share, 0.0) / largest if share is not None and largest > 0 else 0.0
    return {"rms": scale.bare(entry.get("rms")), "share": percent(share), "tint": tint}
