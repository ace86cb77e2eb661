"""Parts of a trace that are flat at its extreme, as clipped ones are."""

import numpy as np
from jaxtyping import Float

from ._thresholds import THRESHOLDS


def find_flat(value: Float[np.ndarray, " samples"]) -> list[tuple[int, int]]:
    """First and last sample of each stretch that rests at the largest or the smallest value.

    A digitised sine or triangle rests at its top, too, hardly longer than at the level below.
    """
    good = value[np.isfinite(value)]
    levels = np.unique(good)
    if levels.size < 3:
        return []
    found = []
    for top, beside in ((levels[-1], levels[-2]), (levels[0], levels[1])):
        here, there = _stretches(value == top), _stretches(value == beside)
        if np.sum(value == top) < THRESHOLDS.flat_ratio * np.sum(value == beside):
            continue
        usual = max(b - a + 1 for a, b in there)
        found += [
            (a, b)
            for a, b in here
            if b - a + 1 >= max(THRESHOLDS.flat_samples, THRESHOLDS.flat_ratio * usual)
        ]
    return sorted(found)


def describe_flat(name: str, value: Float[np.ndarray, " samples"]) -> list[str]:
    """A sentence on the flat parts of a column; none where there are none."""
    found = find_flat(value)
    if not found:
        return []
    longest = max(b - a + 1 for a, b in found)
    shown = ", ".join(f"{a}-{b}" for a, b in found[:3])
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    return [
        f"the {name} is flat at its extreme for up to {longest} samples (samples {shown}{more}): "
        "clipped, unless the drive rests there. Widen the input range and record again"
    ]


def _stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
