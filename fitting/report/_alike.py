"""What is said of several runs, scans or recordings in the same words is said once."""

import re
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any, TypeVar

Item = TypeVar("Item")

_SHOWN_WHOLE = 4  # notes in the same words; more would push the rest off the screen
_OWN = re.compile(r"'[^']*'|[-+]?\d[\d.e+-]*")
_RUN = re.compile(r"run '([^']*)'")
_DECISIVE = ("nothing explained", "no signal")  # a fit of which nothing else is worth reading


def wording(text: str) -> str:
    """A text without names in quotes and numbers, which differ from run to run."""
    return _OWN.sub("#", text)


def group_alike(items: Iterable[Item], key: Callable[[Item], Hashable]) -> list[list[Item]]:
    """The items by `key`, groups in the order of their first."""
    groups: dict[Hashable, list[Item]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return list(groups.values())


def fold_faults(faults: Sequence[Any]) -> list[str]:
    """Kind and message of each `Fault`; one that several runs have is that of the first."""
    return [
        _say_once(f"{first.kind}: {first.message}", first.run, [one.run for one in others])
        for first, *others in group_alike(faults, lambda one: (one.kind, wording(one.message)))
    ]


def fold_reasons(reasons: Sequence[str]) -> list[str]:
    """The reasons of a verdict, that which decides first; one that several runs have, once."""
    ranked = sorted(reasons, key=lambda reason: not reason.startswith(_DECISIVE))
    return [
        _say_once(first, _run_of(first), [_run_of(one) for one in others]) if others else first
        for first, *others in group_alike(ranked, _kind_of)
    ]


def _kind_of(reason: str) -> str:
    """The same for reasons that differ in their run and in numbers alone."""
    return reason if _run_of(reason) is None else wording(reason)


def _run_of(reason: str) -> str | None:
    found = _RUN.search(reason)
    return None if found is None else found[1]


def _say_once(text: str, run: str | None, others: Sequence[str | None]) -> str:
    names = list(dict.fromkeys(one for one in others if one and one != run))
    more = f" The same in {', '.join(names)}." if names else ""
    return f"{text.rstrip('.')}.{more}"


def fold_notes(notes: Sequence[str]) -> list[str]:
    """Notes for a terminal: of more than four in the same words the first two, and a count."""
    out = []
    for alike in group_alike(notes, wording):
        shown = alike if len(alike) <= _SHOWN_WHOLE else alike[:2]
        out += shown
        if len(shown) < len(alike):
            out.append(f"and {len(alike) - 2} more like these; the manifest has them all")
    return out
