"""Cycles of a drive whose noise hides where it turns: they are sought in a moving average."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._thresholds import THRESHOLDS

from ._cycles import Cycle, find_cycles

Samples = Float[np.ndarray, " samples"]


def find_noisy_cycles(
    drive: Samples, step_s: float, repeated: Callable[[list[Cycle]], list[list[Cycle]]]
) -> tuple[Samples, list[Cycle], str] | None:
    """The moving average in which most of the drive repeats, its cycles, and what was done.

    `repeated` groups cycles that are alike. The average is shorter than a cycle by far, and removes
    no more than white noise: a tone is part of the drive. `None` where half the cycles or more
    repeat in no such average.
    """
    noise = float(np.std(np.diff(drive, 3))) / np.sqrt(20.0)  # of white noise: 1 + 9 + 9 + 1
    if not noise > 0.0:
        return None
    best, most, width = None, 0, 3
    while width * THRESHOLDS.averaged_share < drive.size:
        calm = _average(drive, width)
        if float(np.std(drive - calm)) > THRESHOLDS.averaged_noise * noise:
            break
        cycles = find_cycles(calm, step_s)
        long = all(c.last - c.first > width * THRESHOLDS.averaged_share for c in cycles)
        kept = repeated(cycles) if long else []
        held = sum(group[-1].last - group[0].first for group in kept)
        if held > most and sum(map(len, kept)) >= len(cycles) / 2.0:
            best, most = (calm, cycles, width), held
        width = 2 * width - 1
    if best is None:
        return None
    return *best[:2], (
        f"the drive carries noise of {noise:.2g} rms: its turns are those of its average over "
        f"{best[2]} samples; where the drive that was sent is known, give that"
    )


def _average(drive: Samples, width: int) -> Samples:
    """Over `width` samples, an odd number; at the ends over those that there are."""
    sums = np.concatenate([[0.0], np.cumsum(drive - drive[0])])
    at, half = np.arange(drive.size), width // 2
    first = np.maximum(at - half, 0)
    last = np.minimum(at + half, drive.size - 1) + 1
    return drive[0] + (sums[last] - sums[first]) / (last - first)
