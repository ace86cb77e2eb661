"""Table of wrong verdicts, and of the measures each counts against."""

from collections.abc import Sequence
from typing import Any

from fitting.blind.protocol._verdict_names import FAILED, NONE, UNLISTED
from fitting.blind.scoring._outcome import Outcome
from fitting.blind.scoring._rates import LISTED
from fitting.blind.scoring._thresholds import THRESHOLDS

FIELDS = (
    "name", "kind", "truth", "size", "base_misfit", "withheld", "verdict", "probability", "set",
    "against", "error",
)  # fmt: skip


def list_failures(entries: Sequence[Outcome]) -> list[dict[str, Any]]:
    """Wrong verdicts, and right ones outside their own set; the largest effects first."""
    wrong = [e for e in entries if e.verdict != e.correct or e.correct not in e.credible_set]
    return [_row(e) for e in sorted(wrong, key=lambda e: (-e.size, e.name))]


def _row(entry: Outcome) -> dict[str, Any]:
    return {
        "name": entry.name,
        "kind": entry.kind,
        "truth": "+".join(sorted(entry.answer["truth"])) or NONE,
        "size": entry.size,
        "base_misfit": entry.base_misfit,
        "withheld": entry.withheld,
        "verdict": entry.verdict,
        "probability": None if entry.error else entry.confidence,
        "set": list(entry.credible_set),
        "against": failed_measures(entry),
        "error": entry.error,
    }


def failed_measures(entry: Outcome) -> list[str]:
    """The measures that this verdict speaks against; none for an effect too small to be judged."""
    wrong = entry.verdict != entry.correct
    seen, large = entry.size >= THRESHOLDS.detectable, entry.is_nameable
    found = {
        "leave one out": entry.withheld is not None and wrong,
        "false alarm": entry.is_null and wrong,
        "detection": not entry.is_null and seen and entry.verdict in (NONE, FAILED),
        "top-1": entry.kind == "listed" and large and entry.separable and wrong,
        "form": entry.kind == "form" and large and wrong,
        "pair": entry.kind == "pair" and large and wrong,
        "unlisted": entry.kind == "unlisted" and large and wrong,
        "listed called unlisted": entry.kind in LISTED
        and large
        and entry.verdict in (UNLISTED, FAILED),
        "set": entry.is_detectable and entry.correct not in entry.credible_set,
    }
    if entry.withheld is not None:
        return [name for name in ("leave one out", "set") if found[name]]
    return [name for name, is_so in found.items() if is_so]
