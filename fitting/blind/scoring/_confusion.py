"""Confusion matrix: how often each truth was given each verdict."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

from ._outcome import Outcome


def confusion(entries: Sequence[Outcome]) -> dict[str, Any]:
    """Counts by truth and verdict; unlisted effects keep the names of what they are."""
    rows: dict[str, Counter[str]] = {}
    for entry in entries:
        rows.setdefault(_truth(entry), Counter())[entry.verdict] += 1
    return {
        name: dict(sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))
        for name, counts in sorted(rows.items(), key=lambda pair: _order(pair[0]))
    }


def _truth(entry: Outcome) -> str:
    name = "+".join(sorted(entry.answer["truth"])) or entry.correct
    return f"{name} (form)" if entry.kind == "form" else name


def _order(name: str) -> tuple[int, str]:
    """Nulls, singles, pairs, unlisted."""
    if name == "none":
        return 0, name
    return (3 if name.startswith("unlisted:") else 2 if "+" in name else 1), name
