"""Jumps of the response in what a fit leaves: mode hops of a laser."""

import numpy as np

from rapi_jax import Recording
from rapi_jax.internal import usable

from ._fault import Fault, format_intervals
from ._step_detection import detect_steps
from ._thresholds import THRESHOLDS
from .readings._levels import find_resolution

_HOP = (
    "a mode hop, fringes miscounted, or samples lost there. Leave that part out, or shift bias or "
    "current."
)
_JUMP = (
    "the sensor or its range switched, a contact slipped, or samples were lost there. Leave that "
    "part out, or record again."
)


def find_mode_hops(recording: Recording, errors: list[np.ndarray]) -> list[Fault]:
    """Steps in a run's residual that stand clear of noise and misfit: mode hops of a laser.

    `errors` are model less data, one array a run. In a reading that is no optical frequency such a
    step is a jump, of whatever cause. Where the drive jumps, too, a model that misses the answer to
    it leaves a step: none is found there.
    """
    found = []
    optical = recording.response_unit == "GHz"  # files in Hz or MHz are read as GHz
    kind, cause = ("mode hop", _HOP) if optical else ("jump", _JUMP)
    for run, error in zip(recording.runs, errors, strict=True):
        lag = recording.response_lag_s
        index = np.flatnonzero(usable(run, lag) & ~_jumps(run.drive.delayed(lag).value))
        if not index.size or run.span == 0:
            continue
        reading = run.response[index]
        predicted = reading + error[index]
        least = max(
            THRESHOLDS.step_share * run.span, THRESHOLDS.step_resolution * find_resolution(reading)
        )
        drive = run.drive.delayed(recording.response_lag_s).value[index]
        steps = detect_steps(error[index], predicted, drive, index, least)
        if steps:
            size = float(np.median([abs(height) for _, height in steps]))
            places = [(place, place) for place, _ in steps]
            found.append(
                Fault(
                    kind,
                    run.name,
                    f"run {run.name!r}: the response jumps by about {size:.3g} "
                    f"{recording.response_unit} at sample{'s' * (len(places) > 1)} "
                    f"{format_intervals(places)}, which no hysteresis does: {cause}",
                    tuple(places),
                )
            )
    return found


def _jumps(drive: np.ndarray) -> np.ndarray:
    """Which samples are within one of a jump of the drive."""
    moved = np.abs(np.diff(drive)) > THRESHOLDS.drive_jump * np.ptp(drive)
    beside = np.zeros(drive.size + 2, dtype=bool)
    for shift in range(4):
        beside[shift : shift + moved.size] |= moved
    return beside[1:-1]
