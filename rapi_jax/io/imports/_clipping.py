"""Parts of a trace that are flat at its extreme, as clipped ones are."""

from collections.abc import Callable, Sequence

import numpy as np
from jaxtyping import Float

from rapi_jax.recording._run import Run

from ._thresholds import THRESHOLDS

Samples = Float[np.ndarray, " samples"]


def find_flat(value: Samples) -> list[tuple[int, int]]:
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


def describe_flat(
    name: str, runs: Sequence[tuple[Run, int]], value: Callable[[Run], Samples]
) -> list[str]:
    """A sentence on the flat parts within the runs of a record; none where there are none.

    `runs`: each with its first sample in the record; `value`: its drive or its response. Of a drive
    that repeats only whole periods are looked at: it may rest before and after them.
    """
    at, values, names = [], [], []
    for run, first in runs:
        whole = run.drive.period >= 0 if run.drive.periods else np.ones(run.drive.size, dtype=bool)
        use = np.flatnonzero(whole)
        at += [first + use, [-1]]
        values += [value(run)[use], [np.nan]]  # parts the runs
        names += [run.name] * (use.size + 1)
    place = np.concatenate(at)
    found = find_flat(np.concatenate(values))
    if not found:
        return []
    longest = max(b - a + 1 for a, b in found)
    shown = ", ".join(f"{place[a]}-{place[b]}" for a, b in found[:3])
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    within = list(dict.fromkeys(names[a] for a, _ in found))
    others = f" and {len(within) - 4} more runs" if len(within) > 4 else ""
    return [
        f"the {name} is flat at its extreme for up to {longest} samples within "
        f"{', '.join(within[:4])}{others} (samples {shown}{more}): clipped, unless the drive rests "
        "there. Widen the input range and record again"
    ]


def _stretches(mask: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.r_[0, mask.astype(int), 0]))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
