"""Faults of a recording as lines of text."""

import re
from collections.abc import Sequence
from typing import Any

_OWN = re.compile(r"'[^']*'|[-+]?\d[\d.e+-]*")  # names and numbers, which differ from run to run


def fold_faults(faults: Sequence[Any]) -> list[str]:
    """Kind and message of each `Fault`; what is said of several runs in the same words, once."""
    groups: dict[tuple[str, str], list[Any]] = {}
    for fault in faults:
        groups.setdefault((fault.kind, _OWN.sub("#", fault.message)), []).append(fault)
    out = []
    for (kind, _), alike in groups.items():
        first, *others = alike
        names = list(dict.fromkeys(one.run for one in others if one.run and one.run != first.run))
        more = f" The same in {', '.join(names)}." if names else ""
        out.append(f"{kind}: {first.message.rstrip('.')}.{more}")
    return out
