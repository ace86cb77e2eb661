"""Drives that carry noise the response does not follow; drive and response exchanged."""

import numpy as np

from rapi_jax import Recording
from rapi_jax.internal import usable

from ._data_checks import Fault
from ._thresholds import THRESHOLDS


def find_drive_noise(recording: Recording, errors: list[np.ndarray]) -> list[Fault]:
    """Runs whose residual changes from sample to sample as the drive does.

    `errors` are model less data, one array a run. A model answers to noise in the reading of the
    drive, a device does not; thresholds and slopes then come out too small.
    """
    found = []
    for run, error in zip(recording.runs, errors, strict=True):
        use = np.flatnonzero(usable(run, recording.response_lag_s))
        if use.size < THRESHOLDS.outlier_samples:
            continue
        drive = run.drive.delayed(recording.response_lag_s).value[use]
        fast, left = np.diff(drive, 3), np.diff(error[use], 3)
        # The corners of a drive are not noise, and stand far out.
        calm = np.abs(fast) <= THRESHOLDS.drive_noise_calm * np.median(np.abs(fast))
        if calm.sum() < THRESHOLDS.outlier_samples or not fast[calm].any() or not left[calm].any():
            continue
        if not _alternates(fast):
            continue
        together = float(np.corrcoef(fast[calm], left[calm])[0, 1])
        noise = float(np.std(fast[calm])) / np.sqrt(20.0)
        if together > THRESHOLDS.drive_noise_correlation:
            text = (
                f"run {run.name!r}: the drive as written carries noise of {noise:.2g} "
                f"{recording.drive_unit} that the response does not follow (correlation "
                f"{together:.2f} with what the model leaves). Write the drive that was sent "
                "instead of its reading (`rapi import --drive-amplitude` makes it), or average its "
                "samples (`--decimate`)."
            )
            if _is_commanded(run.response[use], THRESHOLDS.reading_noise):
                text += (
                    " The response carries no noise: its column may be swapped with the drive's."
                )
            found.append(Fault("noisy drive", run.name, text, ((0, run.drive.size - 1),)))
    return found


def find_swapped_columns(recording: Recording) -> list[Fault]:
    """Readings that are commanded waveforms, under drives that were measured."""
    found = []
    for run in recording.runs:
        least = THRESHOLDS.commanded
        rough = np.median(np.abs(np.diff(run.drive.value, 3))) > least * run.drive.u_pp
        if rough and _is_commanded(run.response[run.valid], least):
            text = (
                f"run {run.name!r}: the response is as smooth as a command and the drive as rough "
                "as a measurement: the columns `drive` and `response` are swapped."
            )
            found.append(Fault("columns swapped", run.name, text, ((0, run.drive.size - 1),)))
    return found if len(found) == len(recording.runs) else []


def _is_commanded(reading: np.ndarray, least: float) -> bool:
    """Whether a reading is as smooth as a command: below `least` of its span, sample to sample.

    A reading that is digitised coarsely rests on most samples, which no command does that moves.
    """
    if np.ptp(reading) == 0:
        return True
    rests = np.median(np.abs(np.diff(reading))) == 0.0 and np.unique(reading).size > 2
    fast = float(np.median(np.abs(np.diff(reading, 3))))
    return not rests and not fast > least * float(np.ptp(reading))


def _alternates(fast: np.ndarray) -> bool:
    """Whether third differences turn from each to the next, as those of white noise do (-3/4)."""
    return float(fast[1:] @ fast[:-1]) < -0.5 * float(fast @ fast)
