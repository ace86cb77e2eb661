"""Every wrong verdict by name, and which measures it counts against."""

from collections.abc import Sequence
from typing import Any

from fitting.blind.protocol._verdict_names import FAILED, NONE, UNLISTED

from ._counts import LARGE, LISTED, SEEN
from ._entry import Entry

FIELDS = (
    "name", "kind", "truth", "size", "base_misfit", "withheld", "verdict", "probability", "set",
    "against", "error",
)  # fmt: skip


def failures(entries: Sequence[Entry]) -> list[dict[str, Any]]:
    """Wrong verdicts, and right ones outside their own set; the largest effects first."""
    wrong = [e for e in entries if e.said != e.right or e.right not in e.names]
    return [_row(e) for e in sorted(wrong, key=lambda e: (-e.size, e.name))]


def _row(entry: Entry) -> dict[str, Any]:
    return {
        "name": entry.name,
        "kind": entry.kind,
        "truth": "+".join(sorted(entry.answer["truth"])) or NONE,
        "size": entry.size,
        "base_misfit": entry.base_misfit,
        "withheld": entry.withheld,
        "verdict": entry.said,
        "probability": None if entry.error else entry.confidence,
        "set": list(entry.names),
        "against": against(entry),
        "error": entry.error,
    }


def against(entry: Entry) -> list[str]:
    """The measures that this verdict speaks against; none for an effect too small to be judged."""
    wrong = entry.said != entry.right
    seen, large = entry.size >= SEEN, entry.size >= LARGE
    found = {
        "leave one out": entry.withheld is not None and wrong,
        "false alarm": entry.null and wrong,
        "detection": not entry.null and seen and entry.said in (NONE, FAILED),
        "top-1": entry.kind == "listed" and large and entry.separable and wrong,
        "form": entry.kind == "form" and large and wrong,
        "pair": entry.kind == "pair" and large and wrong,
        "unlisted": entry.kind == "unlisted" and large and wrong,
        "listed called unlisted": entry.kind in LISTED
        and large
        and entry.said in (UNLISTED, FAILED),
        "set": (entry.null or seen) and entry.right not in entry.names,
    }
    if entry.withheld is not None:
        return [name for name in ("leave one out", "set") if found[name]]
    return [name for name, is_so in found.items() if is_so]
