"""The clock of a run: even steps from 0."""

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError

from ._thresholds import THRESHOLDS


def check_clock(time: np.ndarray) -> None:
    """Raise `DataError` where `time` (s) does not begin at 0 and go on in even steps."""
    if time.size < 3:
        raise DataError(
            f"A run needs at least 3 samples, but `time_s` has {time.size}. Record it again, or "
            "leave this run out."
        )
    step = np.diff(time)
    usual = float(np.median(step))
    back = np.flatnonzero(step <= 0)
    if back.size:
        i = int(back[0])
        kind = "repeats" if step[i] == 0 else "goes back"
        raise DataError(
            f"`time_s` {kind} at sample {i + 1} ({time[i]:g} s, then {time[i + 1]:g} s). Time must "
            "increase: sort the record, or remove the sample that was written twice."
        )
    if abs(time[0]) > usual:
        raise DataError(
            f"`time_s` starts at {time[0]:g} s, but must start at 0 in each run. Subtract the "
            "first time, and give the run's place in the session as `start_s`."
        )
    stretches = even_stretches(step)
    if len(stretches) > 1:
        raise DataError(
            f"`time_s` has several sampling rates: {_describe_stretches(time, stretches)}. That is "
            "no jitter: make a run of each part (`start_s` says when it begins), or interpolate "
            "the record to the longest of these steps."
        )
    gap = np.flatnonzero(step > 1.5 * usual)
    if gap.size:
        i = int(gap[0])
        lost = round(step[i] / usual) - 1
        raise DataError(
            f"about {lost} sample(s) are missing after sample {i} (t = {time[i]:g} s; {gap.size} "
            "gap(s) in all). Samples dropped while recording move everything after them: record "
            "again."
        )
    uneven = np.flatnonzero(np.abs(step - usual) > 0.25 * usual)
    if uneven.size:
        i = int(uneven[0])
        raise DataError(
            f"`time_s` jitters: the step after sample {i} is {step[i]:g} s, the usual one "
            f"{usual:g} s ({uneven.size} such steps). Export evenly sampled data, or times with "
            "more digits."
        )


def even_stretches(step: Float[np.ndarray, " steps"]) -> list[tuple[int, int]]:
    """First and last step of each stretch of equal steps, where these are nearly all there is.

    Empty where the steps jitter, or where all stretches have one step: what is between are gaps.
    """
    change = np.abs(np.diff(step)) > THRESHOLDS.clock_change * np.minimum(step[1:], step[:-1])
    edges = np.r_[0, np.flatnonzero(change) + 1, step.size]
    found = [(int(a), int(b) - 1) for a, b in zip(edges[:-1], edges[1:], strict=True)]
    long = [(a, b) for a, b in found if b - a + 1 >= THRESHOLDS.clock_stretch]
    even = sum(b - a + 1 for a, b in long) >= THRESHOLDS.clock_even * step.size
    steps = [float(np.median(step[a : b + 1])) for a, b in long]
    differ = bool(steps) and max(steps) > (1.0 + THRESHOLDS.clock_change) * min(steps)
    return long if even and differ else []


def _describe_stretches(
    time: Float[np.ndarray, " samples"], stretches: list[tuple[int, int]]
) -> str:
    shown = [
        f"every {(time[b + 1] - time[a]) / (b + 1 - a):.4g} s from {time[a]:.6g} s"
        for a, b in stretches[:3]
    ]
    more = f" and {len(stretches) - 3} more stretches" if len(stretches) > 3 else ""
    return ", then ".join(shown) + more
