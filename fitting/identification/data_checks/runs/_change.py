"""One change of some runs, and the recording with it taken back."""

import dataclasses
from collections.abc import Callable

import numpy as np

from rapi_jax import Drive, Recording, Run

ORIGINS = "origins"  # each run has one of its own


@dataclasses.dataclass(frozen=True)
class Change:
    """One change of some runs: `size` is in the unit of its kind, as the runs differ from others.

    `explained`: the share of the squared gap that goes with it.
    """

    kind: str
    rows: tuple[int, ...]
    size: float
    explained: float


def undo(recording: Recording, change: Change) -> Recording:
    """The recording with the change taken back in its runs."""
    runs = list(recording.runs)
    for row in change.rows:
        run = runs[row]
        runs[row] = _UNDO[change.kind](run, change.size)
    return dataclasses.replace(recording, runs=tuple(runs))


def _redriven(run: Run, **changes: object) -> Run:
    return dataclasses.replace(run, drive=dataclasses.replace(run.drive, **changes))


def _earlier(run: Run, size: float) -> Run:
    time, y = run.drive.time, run.response
    return dataclasses.replace(run, response=np.interp(time - size, time, y))


def _rescaled_rate(run: Run, size: float) -> Run:
    drive: Drive = run.drive
    factor = 1.0 + size
    rate = None if drive.excitation_hz is None else drive.excitation_hz * factor
    return _redriven(run, time=drive.time / factor, excitation_hz=rate)


_UNDO: dict[str, Callable[[Run, float], Run]] = {
    "offset": lambda run, size: dataclasses.replace(run, response=run.response - size),
    "gain": lambda run, size: dataclasses.replace(run, response=run.response / (1.0 + size)),
    "shift": _earlier,
    "bias": lambda run, size: _redriven(run, value=run.drive.value + size),
    "rate": _rescaled_rate,
}
