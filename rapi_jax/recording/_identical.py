"""Runs of the same clock, drive and readings, sample for sample."""

import hashlib
from collections.abc import Sequence

import numpy as np

from rapi_jax.recording._run import Run


def identical_runs(runs: Sequence[Run]) -> list[tuple[int, int]]:
    """Pairs of numbers of runs: each run that is the same as an earlier one, after that one.

    >>> import numpy as np
    >>> from rapi_jax import Run, triangle
    >>> from rapi_jax.recording._identical import identical_runs
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=300, periods=3)
    >>> run, other = Run(drive, 4.0 * drive.value), Run(drive, 4.1 * drive.value)
    >>> identical_runs([run, other, run])
    [(0, 2)]
    """
    seen: dict[bytes, int] = {}
    found = []
    for number, run in enumerate(runs):
        digest = hashlib.sha256(f"{run.drive.step_s:.6g} s".encode())
        for values in (run.drive.value, run.response):
            digest.update(np.ascontiguousarray(values, dtype=np.float64).tobytes())
        first = seen.setdefault(digest.digest(), number)
        if first != number:
            found.append((first, number))
    return found
