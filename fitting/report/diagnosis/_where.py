"""The gap's mean square by part, and by run, direction and region."""

import math
from typing import Any

from . import _text as words
from ._numbers import Scale, finite_or_none, format_percent
from .figures._rows import sort_by_rate

_PARTS = (
    ("structural", "not described by the model"),
    ("parametric", "removed by refitting the parameters"),
    ("noise_floor", "measurement noise"),
)


def tabulate_budget(gap: dict, scale: Scale) -> dict[str, Any] | None:
    """Structural, parametric and noise parts of the mean-square gap; None without a gap."""
    rms = {key: finite_or_none(gap.get(key)) for key, _ in _PARTS}
    # A part that its estimate puts below zero takes no room.
    squares = {key: max(v, 0.0) ** 2 for key, v in rms.items() if v is not None}
    whole = finite_or_none(gap.get("total"))
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
            "percent": format_percent(shares.get(key)),
        }
        for key, name in _PARTS
    ]
    shows = f"Over all runs the model alone leaves a residual of {scale(gap.get('total'))} rms"
    if "structural" in shares and "noise_floor" in shares:
        shows += (
            f"; {format_percent(shares['structural'])} of its mean square is neither noise nor "
        )
        shows += "a matter of parameters"
    return {
        "parts": parts,
        "shows": f"{shows}.",
        "synchronous": describe_synchronous_part(gap, scale),
    }


def describe_synchronous_part(gap: dict, scale: Scale) -> str:
    """The scan-synchronous and the non-synchronous part of the gap, in a sentence."""
    parts_of_gap = (("locked", "repeats with the scan"), ("not_locked", "does not"))
    # Estimates of a mean square less its noise: at or below zero there is nothing to see.
    parts = [
        f"the part that {text} is {scale(value) + ' rms' if value > 0 else 'zero'}"
        for key, text in parts_of_gap
        if (value := finite_or_none(gap.get(key))) is not None
    ]
    return f"Above the noise, {words.join_items(parts)}." if parts else ""


def tabulate_residuals(where: list[dict], scale: Scale, drive_unit: str) -> dict[str, Any] | None:
    """Residuals by run (down) and by direction and region (across), each with its share."""
    if not where:
        return None
    columns = list(dict.fromkeys(_column_of(e) for e in where))
    columns.sort(key=lambda place: {"up": 0, "down": 1}.get(place[0], 2))
    largest = max((finite_or_none(e.get("share")) or 0.0 for e in where), default=0.0)
    rows: dict[Any, dict[str, Any]] = {}
    for e in sort_by_rate(where):
        scan = words.label_run(e, drive_unit)
        name = words.name_run(e)
        row = rows.setdefault(
            e.get("run"),
            {"scan": scan, "name": "" if name == scan else name, "cells": [None] * len(columns)},
        )
        row["cells"][columns.index(_column_of(e))] = _make_cell(e, largest, scale)
    shows = ""
    if largest > 0:
        top = max(where, key=lambda e: finite_or_none(e.get("share")) or 0.0)
        direction, region = _column_of(top)
        shows = (
            f"The largest share of the gap, {format_percent(top.get('share'))}, lies in the run at "
            f"{words.label_run(top, drive_unit)}, {_name_place(direction, region)}: "
            f"{scale(_rms(top))} rms above the noise."
        )
    heads = [", ".join(filter(None, place)) for place in columns]
    return {"columns": heads, "rows": list(rows.values()), "shows": shows, "unit": scale.unit}


def _rms(entry: dict) -> float | None:
    """Of what stands above the noise in a part, whether it repeats with the scan or not."""
    known = [finite_or_none(entry.get(key)) for key in ("rms", "rms_not_locked")]
    parts = [part for part in known if part is not None]
    return math.hypot(*parts) if parts else None


def _name_place(direction: str, region: str) -> str:
    """A part of a run in running text: "scanning up, near the turning points"."""
    near = {"edge": "near the turning points", "middle": "between the turning points"}
    way = f"scanning {direction}" if direction else ""
    return ", ".join(filter(None, [way, near.get(region, region)]))


def _column_of(entry: dict) -> tuple[str, str]:
    return str(entry.get("direction") or ""), str(entry.get("region") or "")


def _make_cell(entry: dict, largest: float, scale: Scale) -> dict[str, Any]:
    share = finite_or_none(entry.get("share"))
    tint = max(share, 0.0) / largest if share is not None and largest > 0 else 0.0
    return {"rms": scale.bare(_rms(entry)), "share": format_percent(share), "tint": tint}
