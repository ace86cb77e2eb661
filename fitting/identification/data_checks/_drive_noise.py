"""Drives that carry noise the response does not follow; drive and response exchanged."""

import numpy as np

from rapi_jax import Recording, Run
from rapi_jax.internal import usable

from ._fault import Fault
from ._thresholds import THRESHOLDS


def find_drive_noise(recording: Recording, errors: list[np.ndarray]) -> list[Fault]:
    """Runs whose residual changes from sample to sample as the drive does.

    `errors` are model less data, one array a run. A model answers to noise in the reading of the
    drive, a device does not; thresholds and slopes then come out too small.
    """
    return _find_noise(recording, errors, "what the model leaves")


def foresee_drive_noise(recording: Recording) -> list[Fault]:
    """Runs that a fit would refuse for noise of their drive, before any fit.

    A smooth curve through the loop answers to noise of the drive as a model does.
    """
    errors = [
        _smooth_response(run, recording.response_lag_s) - run.response for run in recording.runs
    ]
    return _find_noise(
        recording, errors, "what a smooth curve leaves, and so with what a fit would leave"
    )


def _find_noise(recording: Recording, errors: list[np.ndarray], beside: str) -> list[Fault]:
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
                f"{together:.2f} with {beside}): noise of its reading, not of the device. "
            )
            if _is_commanded(run.response[use], THRESHOLDS.reading_noise):
                text += (
                    "The response carries no noise at all, so most likely its column was swapped "
                    "with the drive's: exchange the two. If it was not: "
                )
            text += _cure(run)
            found.append(Fault("noisy drive", run.name, text, ((0, run.drive.size - 1),)))
    return found


def _cure(run: Run) -> str:
    """What to do about noise of a drive: what an import can put in place of its readings."""
    if run.drive.repeats and run.drive.waveform in ("triangle", "sine"):
        return (
            f"Import it again with `--drive-as fitted`: the {run.drive.waveform} nearest to the "
            "readings takes their place."
        )
    if run.drive.repeats:
        return (
            "Import it again with `--drive-as averaged`: the mean of its periods takes the place "
            "of the readings."
        )
    return (
        "Write the drive that was sent in place of its readings, or import it again with averages "
        "of its samples (`--decimate 10`)."
    )


def _smooth_response(run: Run, lag_s: float) -> np.ndarray:
    """A cubic in the drive, nearest to the response: its value at every sample."""
    drive = run.drive.delayed(lag_s).value
    if run.drive.u_pp == 0 or run.valid.sum() < THRESHOLDS.outlier_samples:
        return np.zeros(drive.size)
    scaled = (drive - drive.mean()) / run.drive.u_pp
    columns = np.stack([scaled**power for power in range(4)], axis=1)
    return columns @ np.linalg.lstsq(columns[run.valid], run.response[run.valid], rcond=None)[0]


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
