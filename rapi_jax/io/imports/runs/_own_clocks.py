"""A record whose sampling rate changes, as stretches that each keep a clock of their own."""

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._clock import Stretch, is_even
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.io.imports.cycles._cycles import find_cycles
from rapi_jax.sampling._clock import even_stretches

Samples = Float[np.ndarray, " samples"]


def own_clocks(time: Samples, drive: Samples) -> tuple[Samples, list[Stretch], list[str]] | None:
    """The times (s) of a record, its stretches of one sampling rate each, and what was done.

    `None` where the clock jitters, where it has one rate, or where a stretch holds no whole cycle
    of the drive: such a record can only be resampled, which averages its faster stretches. A sample
    between two rates belongs to the later one: records that were joined go on one step after the
    last sample of the record before.
    """
    steps = even_stretches(np.diff(time))
    if len(steps) < 2:
        return None
    ends = [min(b + 2, after[0]) for (_, b), after in zip(steps, [*steps[1:], (time.size, 0)],
                                                          strict=True)]  # fmt: skip
    stretches = [(a, end) for (a, _), end in zip(steps, ends, strict=True)]
    time = time.copy()
    rates = []
    for a, b in stretches:
        step = float(time[b - 1] - time[a]) / (b - 1 - a)
        even = np.linspace(time[a], time[b - 1], b - a)
        if np.abs(time[a:b] - even).max() <= THRESHOLDS.uneven_step * step:
            time[a:b] = even
        if is_even(time[a:b]) or not find_cycles(drive[a:b], step):
            return None
        rates.append(1.0 / step)
    shown = [
        f"{rate:.6g} Hz from {time[a]:.6g} s"
        for rate, (a, _) in zip(rates[:5], stretches, strict=False)
    ]
    more = f" and {len(rates) - 5} more" if len(rates) > 5 else ""
    notes = [
        f"the sampling rate changes ({', '.join(shown)}{more}): each part is cut into runs of its "
        "own, which keep their sampling rate"
    ]
    lost = time.size - sum(b - a for a, b in stretches)
    notes += [f"dropped {lost} sample(s) between parts of different sampling rate"] if lost else []
    return time, stretches, notes
