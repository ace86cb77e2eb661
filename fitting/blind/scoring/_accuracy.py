"""Top-1 accuracy: by kind, effect, size and unabsorbed fraction; and closed fractions."""

from collections.abc import Sequence
from typing import Any

from ._outcome import Outcome
from ._rates import LISTED, VerdictOf, diagnosis_verdict, quantile
from ._thresholds import THRESHOLDS
from ._wilson import proportion

SIZES = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 20.0, float("inf"))
SURVIVALS = (0.0, 0.05, 0.1, 0.2, 0.5, float("inf"))


def top_1_accuracy(
    entries: Sequence[Outcome], verdict_of: VerdictOf = diagnosis_verdict
) -> dict[str, Any]:
    """Separable single listed effects of 4 sigma or more whose verdict is their name."""
    large = [e for e in entries if e.kind == "listed" and e.is_nameable and e.separable]
    return _accuracy(
        [e for e in large if verdict_of(e) is not None], verdict_of, least=THRESHOLDS.top_1_target
    )


def accuracy_by_kind(entries: Sequence[Outcome]) -> dict[str, Any]:
    """The same for each kind; `pair_either`: at least one of the two is among the names."""
    large = [e for e in entries if e.is_nameable and e.separable]
    out = {kind: _accuracy([e for e in large if e.kind == kind]) for kind in LISTED}
    pairs = [e for e in large if e.kind == "pair"]
    either = sum(bool(set(e.verdict.split("+")) & set(e.correct.split("+"))) for e in pairs)
    return out | {"pair_either": proportion(either, len(pairs))}


def accuracy_by_effect(entries: Sequence[Outcome]) -> dict[str, Any]:
    """Right verdicts on single listed effects of 4 sigma or more, whether separable or not."""
    large = [e for e in entries if e.kind in ("listed", "form") and e.is_nameable]
    names = sorted({e.correct for e in large})
    return {name: _accuracy([e for e in large if e.correct == name]) for name in names}


def accuracy_by_size(entries: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Right verdicts of each kind in bins of size; nulls are not there."""
    kinds = (*LISTED, "unlisted")
    rows = []
    for low, high in zip(SIZES, SIZES[1:], strict=False):
        inside = [e for e in entries if not e.is_null and low <= e.size < high]
        rows.append(
            {"from": low, "to": None if high == float("inf") else high, "all": _accuracy(inside)}
            | {kind: _accuracy([e for e in inside if e.kind == kind]) for kind in kinds}
        )
    return [row for row in rows if row["all"]["n"] or row["from"] >= SIZES[1]]


def accuracy_by_survival(entries: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Right verdicts on single listed effects of 4 sigma or more, by unabsorbed fraction."""
    large = [e for e in entries if e.kind in ("listed", "form") and e.is_nameable]
    rows: list[dict[str, Any]] = []
    for low, high in zip(SURVIVALS, SURVIVALS[1:], strict=False):
        inside = [
            e
            for e in large
            if e.unabsorbed_fraction is not None and low <= e.unabsorbed_fraction < high
        ]
        end = None if high == float("inf") else high
        rows.append({"from": low, "to": end} | _accuracy(inside))
    unknown = [e for e in large if e.unabsorbed_fraction is None]
    return [*rows, {"from": None, "to": None} | _accuracy(unknown)]


def closed_fraction(entries: Sequence[Outcome]) -> dict[str, Any]:
    """Of rightly named causes: the part of the gap that closes on data held out."""
    right = [e for e in entries if e.kind in LISTED and e.verdict == e.correct]
    found = [e.diagnosis.get("shrinkage", {}).get("closed_fraction") for e in right]
    values = sorted(float(f["value"]) for f in found if f and f.get("value") is not None)
    record = proportion(sum(v >= THRESHOLDS.closed for v in values), len(values))
    median = quantile(values, 0.5) if values else None
    met = None if median is None else median >= THRESHOLDS.closed
    unknown = len(right) - len(values)
    return record | {
        "target": {"least": THRESHOLDS.closed},
        "met": met,
        "median": median,
        "unknown": unknown,
    }


def _accuracy(
    entries: Sequence[Outcome],
    verdict_of: VerdictOf = diagnosis_verdict,
    least: float | None = None,
) -> dict[str, Any]:
    return proportion(sum(verdict_of(e) == e.correct for e in entries), len(entries), least=least)
