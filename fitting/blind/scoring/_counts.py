"""What is counted of verdicts: detection, false alarms, sets, and effects that no list holds.

`said` of each function gives the verdict to judge: the diagnosis' own, or a baseline's.
"""

from collections.abc import Callable, Sequence
from typing import Any

from fitting.blind.protocol._verdict_names import FAILED, NONE, UNLISTED

from ._entry import Entry
from ._wilson import count_share, judged

SEEN, LARGE = 2.0, 4.0  # multiples of the noise: to be detected, to be named
LISTED = ("listed", "form", "pair")
Said = Callable[[Entry], str | None]


def own(entry: Entry) -> str | None:
    """The diagnosis' verdict."""
    return entry.said


def detection(entries: Sequence[Entry], said: Said = own) -> dict[str, Any]:
    """Worlds with an effect of 2 sigma or more in which something was found."""
    judged_ = [e for e in entries if not e.null and e.size >= SEEN and said(e) is not None]
    return count_share(
        sum(said(e) not in (NONE, FAILED) for e in judged_), len(judged_), least=0.98
    )


def false_alarms(
    entries: Sequence[Entry], said: Said = own, *, base_misfit: bool | None = None
) -> dict[str, Any]:
    """Nulls in which something was found: of all, or of those with or without base misfit."""
    nulls = [e for e in entries if e.null and said(e) is not None]
    if base_misfit is not None:
        nulls = [e for e in nulls if e.base_misfit == base_misfit]
    return count_share(sum(said(e) != NONE for e in nulls), len(nulls), most=0.03)


def unlisted_flagged(entries: Sequence[Entry], said: Said = own) -> dict[str, Any]:
    """Worlds with an unlisted effect of 4 sigma or more that were called so."""
    large = [e for e in entries if e.kind == "unlisted" and e.size >= LARGE]
    large = [e for e in large if said(e) is not None]
    return count_share(sum(said(e) == UNLISTED for e in large), len(large), least=0.90)


def unlisted_in_set(entries: Sequence[Entry]) -> dict[str, Any]:
    """The same where the smallest set holds it."""
    large = [e for e in entries if e.kind == "unlisted" and e.size >= LARGE]
    return count_share(sum(UNLISTED in e.names for e in large), len(large))


def listed_called_unlisted(entries: Sequence[Entry], said: Said = own) -> dict[str, Any]:
    """Worlds with listed effects of 4 sigma or more that were called unlisted."""
    large = [e for e in entries if e.kind in LISTED and e.size >= LARGE and said(e) is not None]
    return count_share(sum(said(e) in (UNLISTED, FAILED) for e in large), len(large), most=0.05)


def sets(entries: Sequence[Entry]) -> dict[str, Any]:
    """How often the smallest set holds the right answer, and how many names it has."""
    held = sum(e.right in e.names for e in entries)
    sizes = [len(e.names) for e in entries if e.error is None]
    mean = sum(sizes) / len(sizes) if sizes else None
    return {
        "coverage": count_share(held, len(entries), least=0.95),
        "mean_size": judged(mean, len(sizes), most=1.5),
    }


def can_be_seen(entry: Entry) -> bool:
    """Nulls, and worlds of 2 sigma or more."""
    return entry.null or entry.size >= SEEN


def left_out(entries: Sequence[Entry]) -> dict[str, Any]:
    """Worlds whose effect was not among the candidates: the right answer is unlisted."""
    names = sorted({str(e.withheld) for e in entries})
    return {
        "all": _refused(entries),
        "in_set": count_share(sum(UNLISTED in e.names for e in entries), len(entries)),
        "by_effect": {name: _refused([e for e in entries if e.withheld == name]) for name in names},
    }


def _refused(entries: Sequence[Entry]) -> dict[str, Any]:
    return count_share(sum(e.said == UNLISTED for e in entries), len(entries), least=0.90)


def seconds(entries: Sequence[Entry]) -> dict[str, Any]:
    """How long a diagnosis took, s: median, nine of ten, longest."""
    taken = sorted(float(e.diagnosis["seconds"]) for e in entries if "seconds" in e.diagnosis)
    if not taken:
        return {"n": 0, "median": None, "most_of_ten": None, "longest": None}
    return {
        "n": len(taken),
        "median": quantile(taken, 0.5),
        "most_of_ten": quantile(taken, 0.9),
        "longest": taken[-1],
    }


def quantile(ordered: Sequence[float], part: float) -> float:
    """By straight lines between the values, which must be in order."""
    at = part * (len(ordered) - 1)
    low = int(at)
    high = min(low + 1, len(ordered) - 1)
    return ordered[low] + (at - low) * (ordered[high] - ordered[low])
