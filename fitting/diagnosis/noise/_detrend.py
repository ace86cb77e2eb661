"""Slow changes that a whole session shares, taken out before noise is measured beside them.

A drift leaks into all lines of a short run, and falls with frequency as slow noise does: taken for
noise, it would hide itself. What tells them apart is that one law holds in all runs.
"""

import numpy as np

from ._periods import PeriodBlock
from ._spectrum import Spectrum, Whitener

_POWERS = 3  # of session time
_LAGS = 3  # of what settles after each run's start, between a period and a run
_CHANCE = 30.0  # fall in chi-square that no six laws find in noise


def detrend(
    errors: list[np.ndarray], blocks: list[PeriodBlock], spectrum: Spectrum
) -> list[np.ndarray]:
    """`errors` ("periods phases" by run) less what the session's clock and its starts explain.

    A cubic of session time, and exponentials since the start of each run, all with one size for
    all runs; fitted to what does not repeat with the scan. Where they explain no more than chance,
    `errors` as they are.
    """
    whitener = Whitener(blocks, spectrum, own_origin=True)
    if not any(b.periods > 1 for b in blocks):
        return errors
    laws = _laws(blocks)
    columns = np.stack([whitener.both([law[k] for law in laws])[1] for k in range(len(laws[0]))])
    size = np.linalg.norm(columns, axis=1)
    seen = whitener.both(errors)[1]
    found = np.linalg.lstsq((columns / np.maximum(size, 1e-300)[:, None]).T, seen, rcond=1e-6)[0]
    found = np.where(size > 0, found / np.maximum(size, 1e-300), 0.0)
    rest = seen - found @ columns
    if float(seen @ seen - rest @ rest) < _CHANCE:
        return errors
    return [
        (e - np.tensordot(found, law, 1)) * b.use
        for e, law, b in zip(errors, laws, blocks, strict=True)
    ]


def _laws(blocks: list[PeriodBlock]) -> list[np.ndarray]:
    """Of each run "laws periods phases"."""
    start = min(float(b.time[0, 0]) for b in blocks)
    end = max(float(b.time[-1, -1]) for b in blocks)
    longest = max(b.size * b.step_s for b in blocks)
    shortest = min(b.left.shape[1] * b.step_s for b in blocks)
    lags = np.geomspace(shortest, longest, _LAGS)
    out = []
    for block in blocks:
        whole = (block.time - start) / max(end - start, 1e-300)
        own = block.time - block.time[0, 0]
        powers = [whole ** (k + 1) for k in range(_POWERS)]
        out.append(np.stack([*powers, *(np.exp(-own / lag) for lag in lags)]))
    return out
