"""Slow trends that a whole session shares, removed before noise is measured.

A drift leaks into all lines of a short run, and falls with frequency as slow noise does: taken for
noise, it would hide itself. What distinguishes them is that one law holds in all runs.
"""

import numpy as np
from jaxtyping import Float

from ._periods import PeriodBlock
from ._spectrum import Spectrum
from ._thresholds import THRESHOLDS
from ._whitening import Whitener

_TINY = 1e-300


def detrend(
    errors: list[Float[np.ndarray, "_ _"]], blocks: list[PeriodBlock], spectrum: Spectrum
) -> list[Float[np.ndarray, "_ _"]]:
    """`errors` ("periods phases" by run) less a common function of session time and run time.

    A cubic of session time, and exponentials since the start of each run, all with one size for
    all runs; fitted to what does not repeat with the scan. Where they explain no more than chance,
    `errors` as they are.
    """
    whitener = Whitener(blocks, spectrum, own_origin=True)
    if not any(b.periods > 1 for b in blocks):
        return errors
    trends = _trends(blocks)
    columns = np.stack(
        [whitener.whiten([trend[k] for trend in trends])[1] for k in range(len(trends[0]))]
    )
    size = np.linalg.norm(columns, axis=1)
    seen = whitener.whiten(errors)[1]
    found = np.linalg.lstsq((columns / np.maximum(size, _TINY)[:, None]).T, seen, rcond=1e-6)[0]
    found = np.where(size > 0, found / np.maximum(size, _TINY), 0.0)
    rest = seen - found @ columns
    if float(seen @ seen - rest @ rest) < THRESHOLDS.trend_gain:
        return errors
    return [
        (e - np.tensordot(found, trend, 1)) * b.use
        for e, trend, b in zip(errors, trends, blocks, strict=True)
    ]


def _trends(blocks: list[PeriodBlock]) -> list[Float[np.ndarray, "trends _ _"]]:
    """The trends of each run, "trends periods phases"."""
    start = min(float(b.time[0, 0]) for b in blocks)
    end = max(float(b.time[-1, -1]) for b in blocks)
    longest = max(b.size * b.step_s for b in blocks)
    shortest = min(b.phases * b.step_s for b in blocks)
    lags = np.geomspace(shortest, longest, THRESHOLDS.settling_lags)
    out = []
    for block in blocks:
        whole = (block.time - start) / max(end - start, _TINY)
        own = block.time - block.time[0, 0]
        powers = [whole ** (k + 1) for k in range(THRESHOLDS.trend_powers)]
        out.append(np.stack([*powers, *(np.exp(-own / lag) for lag in lags)]))
    return out
