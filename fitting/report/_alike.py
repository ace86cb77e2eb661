"""What is said of several runs, scans or recordings in the same words is said once."""

import re
from collections.abc import Callable, Hashable, Iterable, Sequence
from typing import Any, TypeVar

Item = TypeVar("Item")

_SHOWN_WHOLE = 4  # notes in the same words; more would push the rest off the screen
_OWN = re.compile(r"'[^']*'|[-+]?\d[\d.e+-]*")


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
    out = []
    for first, *others in group_alike(faults, lambda one: (one.kind, wording(one.message))):
        names = list(dict.fromkeys(one.run for one in others if one.run and one.run != first.run))
        more = f" The same in {', '.join(names)}." if names else ""
        out.append(f"{first.kind}: {first.message.rstrip('.')}.{more}")
    return out


def fold_notes(notes: Sequence[str]) -> list[str]:
    """Notes for a terminal: of more than four in the same words the first two, and a count."""
    out = []
    for alike in group_alike(notes, wording):
        shown = alike if len(alike) <= _SHOWN_WHOLE else alike[:2]
        out += shown
        if len(shown) < len(alike):
            out.append(f"and {len(alike) - 2} more like these; the manifest has them all")
    return out
