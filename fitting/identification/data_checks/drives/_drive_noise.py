"""Drives that carry noise the response does not follow; drive and response exchanged."""

import numpy as np

from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Recording, Run
from rapi_jax.internal import describe_swap, is_read_from_fringes, usable

from ._drive_reading import WHITE, alternates, describe_cure, smooth_response


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
        smooth_response(run, recording.response_lag_s) - run.response for run in recording.runs
    ]
    return _find_noise(recording, errors, "what a fit would leave")


def _find_noise(recording: Recording, errors: list[np.ndarray], beside: str) -> list[Fault]:
    found, swappable = [], not is_read_from_fringes(recording.provenance)
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
        if not alternates(fast):
            continue
        together = float(np.corrcoef(fast[calm], left[calm])[0, 1])
        noise = float(np.std(fast[calm])) / WHITE
        if together > THRESHOLDS.drive_noise_correlation:
            text = (
                f"run {run.name!r}: the drive as written carries noise of {noise:.2g} "
                f"{recording.drive_unit} rms that the response does not show: {beside} follows "
                f"it (correlation {together:.2f}), since a model answers to the drive as written. "
                "It is noise of the drive's reading, not of the device. "
            )
            kind, swap = "noisy drive", _describe_swap(run, use) if swappable else None
            if swap is not None:
                kind, text = "columns swapped", f"{text}{swap}. If they are right: "
            text += describe_cure(run)
            found.append(Fault(kind, run.name, text, ((0, run.drive.size - 1),)))
    return found


def _describe_swap(run: Run, use: np.ndarray) -> str | None:
    """What to say where the response has no noise at all and is the plain waveform of the two.

    A model answers to a noisy drive as to noise of its reading, wherever a search has ended.
    """
    if not _is_commanded(run.response[use], THRESHOLDS.reading_noise):
        return None
    said = describe_swap([run], THRESHOLDS.commanded_ratio, 1.0)
    return None if said is None else f"The response carries no noise at all, and {said}"


def find_swapped_columns(recording: Recording) -> list[Fault]:
    """Readings that are commanded waveforms, under drives that were measured.

    A frequency that was read from fringes is as smooth, and no column of its own. A plain sine of
    few samples a period bends as much from sample to sample as noise, but does not alternate.
    """
    if is_read_from_fringes(recording.provenance):
        return []
    found = []
    for run in recording.runs:
        least = THRESHOLDS.commanded
        fast = np.diff(run.drive.value, 3)
        rough = np.median(np.abs(fast)) > least * run.drive.u_pp and alternates(fast)
        if rough and _is_commanded(run.response[run.valid], least):
            text = (
                f"run {run.name!r}: the response is as smooth as a command and the drive as rough "
                "as a measurement: the columns `drive` and `response` are swapped. Exchange them."
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
