"""How often the right effect was named: first in the list, by size, by what survives the base."""

from collections.abc import Sequence
from typing import Any

from ._counts import LARGE, LISTED, Said, own, quantile
from ._entry import Entry
from ._wilson import count_share

SIZES = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 20.0, float("inf"))
SURVIVALS = (0.0, 0.05, 0.1, 0.2, 0.5, float("inf"))
CLOSED = 0.9


def top_1(entries: Sequence[Entry], said: Said = own) -> dict[str, Any]:
    """Separable single listed effects of 4 sigma or more whose verdict is their name."""
    large = [e for e in entries if e.kind == "listed" and e.size >= LARGE and e.separable]
    return _right([e for e in large if said(e) is not None], said, least=0.95)


def by_kind(entries: Sequence[Entry]) -> dict[str, Any]:
    """The same for each kind; `pair_either`: at least one of the two is among the names."""
    large = [e for e in entries if e.size >= LARGE and e.separable]
    out = {kind: _right([e for e in large if e.kind == kind]) for kind in LISTED}
    pairs = [e for e in large if e.kind == "pair"]
    either = sum(bool(set(e.said.split("+")) & set(e.right.split("+"))) for e in pairs)
    return out | {"pair_either": count_share(either, len(pairs))}


def by_effect(entries: Sequence[Entry]) -> dict[str, Any]:
    """Right verdicts on single listed effects of 4 sigma or more, whether separable or not."""
    large = [e for e in entries if e.kind in ("listed", "form") and e.size >= LARGE]
    names = sorted({e.right for e in large})
    return {name: _right([e for e in large if e.right == name]) for name in names}


def by_size(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Right verdicts of each kind in bins of size; nulls are not there."""
    kinds = (*LISTED, "unlisted")
    rows = []
    for low, high in zip(SIZES, SIZES[1:], strict=False):
        inside = [e for e in entries if not e.null and low <= e.size < high]
        rows.append(
            {"from": low, "to": None if high == float("inf") else high, "all": _right(inside)}
            | {kind: _right([e for e in inside if e.kind == kind]) for kind in kinds}
        )
    return [row for row in rows if row["all"]["n"] or row["from"] >= SIZES[1]]


def by_survival(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Right verdicts on single listed effects of 4 sigma or more, by what survives the base."""
    large = [e for e in entries if e.kind in ("listed", "form") and e.size >= LARGE]
    rows: list[dict[str, Any]] = []
    for low, high in zip(SURVIVALS, SURVIVALS[1:], strict=False):
        inside = [e for e in large if e.survival is not None and low <= e.survival < high]
        end = None if high == float("inf") else high
        rows.append({"from": low, "to": end} | _right(inside))
    unknown = [e for e in large if e.survival is None]
    return [*rows, {"from": None, "to": None} | _right(unknown)]


def closed(entries: Sequence[Entry]) -> dict[str, Any]:
    """Of rightly named causes: the part of the gap that closes on data held out."""
    right = [e for e in entries if e.kind in LISTED and e.said == e.right]
    found = [e.diagnosis.get("shrinkage", {}).get("closed_fraction") for e in right]
    values = sorted(float(f["value"]) for f in found if f and f.get("value") is not None)
    record = count_share(sum(v >= CLOSED for v in values), len(values))
    median = quantile(values, 0.5) if values else None
    met = None if median is None else median >= CLOSED
    unknown = len(right) - len(values)
    return record | {"target": {"least": CLOSED}, "met": met, "median": median, "unknown": unknown}


def _right(
    entries: Sequence[Entry], said: Said = own, least: float | None = None
) -> dict[str, Any]:
    return count_share(sum(said(e) == e.right for e in entries), len(entries), least=least)
