"""Readings and drives of few levels: a coarse converter, a drive that switches."""

import numpy as np

from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Recording, Run


def find_resolution(reading: np.ndarray) -> float:
    """The usual step between the values of a digitised reading; 0 where values hardly repeat."""
    values = np.unique(reading)
    if not 1 < values.size < THRESHOLDS.distinct_values * reading.size:
        return 0.0
    return float(np.median(np.diff(values)))


def check_levels(run: Run) -> Fault | None:
    """A reading of so few levels that a play moves it by less than one."""
    values = run.response[run.valid]
    levels = _levels(values)
    if not 1 < levels <= THRESHOLDS.reading_levels < values.size:
        return None
    text = (
        f"run {run.name!r}: the reading takes {levels} levels and nothing between, which hides "
        "hysteresis. Choose a smaller input range or a finer converter, and record again."
    )
    return Fault("coarse reading", run.name, text, ((0, run.drive.size - 1),))


def find_switched(recording: Recording) -> list[Fault]:
    """Drives that are at one of two levels, where no other run says what lies between."""
    drives = [run.drive.value for run in recording.runs]
    if not all(u.size >= 4 and (_levels(u) == 2 or _is_square(u)) for u in drives):
        return []
    run = recording.runs[0]
    text = (
        f"run {run.name!r}: the drive, as that of all runs, switches between two levels, and no "
        "reading says what the device does between these levels. Record triangles or sines."
    )
    return [Fault("switched drive", run.name, text, ((0, run.drive.size - 1),))]


def _levels(values: np.ndarray) -> int:
    """How many values there are, to a millionth of their span."""
    span = float(np.ptp(values)) if values.size else 0.0
    return np.unique(np.round((values - values.min()) / span, 6)).size if span > 0 else 1


def _is_square(values: np.ndarray) -> bool:
    """Whether nearly all readings of a drive are near either end of its range, with noise."""
    span = float(np.ptp(values))
    if not span > 0:
        return False
    at = (values - values.min()) / span
    ends = np.minimum(at, 1.0 - at) < THRESHOLDS.switched_near
    return bool(ends.mean() > THRESHOLDS.switched_share)
