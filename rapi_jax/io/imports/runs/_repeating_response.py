"""A response that repeats while its drive does not, as where the drive's column is another one."""

from collections.abc import Sequence

import numpy as np

from rapi_jax.io.imports.cycles._cycles import Samples
from rapi_jax.io.imports.cycles._groups import find_repeating, repeated_cycles
from rapi_jax.io.imports.cycles._noisy_cycles import find_noisy_cycles
from rapi_jax.recording._run import Run


def describe_repeating(runs: Sequence[Run]) -> list[str]:
    """A remark where no drive of some runs repeats, and the response of one does; else none."""
    if any(run.drive.repeats for run in runs):
        return []
    for run in runs:
        rate = repetition_hz(run.response, run.drive.step_s)
        if rate is not None:
            return [
                f"the drive does not repeat, but the response of {run.name} does, at {rate:.4g} "
                "Hz: most likely another column is the drive, or the two are exchanged. Name them "
                "by --drive and --response"
            ]
    return []


def repetition_hz(value: Samples, step_s: float) -> float | None:
    """The rate of the most cycles that are alike, Hz; `None` where fewer than half have another.

    They are told as those of a drive are.

    >>> import numpy as np
    >>> from rapi_jax.io.imports.runs._repeating_response import repetition_hz
    >>> time = np.arange(1000) / 1000.0
    >>> round(repetition_hz(np.sin(2 * np.pi * 10.0 * time), 1e-3), 2)
    10.0
    >>> repetition_hz(np.exp(-3.0 * time) * np.sin(60.0 * time), 1e-3) is None
    True
    """
    if not np.isfinite(value).all():
        return None
    cycles = find_repeating(value, step_s)
    kept = repeated_cycles(cycles)
    if 2 * sum(map(len, kept)) < len(cycles) or not kept:
        averaged = find_noisy_cycles(value, step_s, repeated_cycles)
        kept = [] if averaged is None else repeated_cycles(averaged[1])
    longest = max(kept, key=len, default=[])
    return float(np.median([one.rate for one in longest])) if len(longest) > 1 else None
