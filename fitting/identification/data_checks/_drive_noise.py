"""A drive whose reading carries noise that the response does not follow."""

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
                "instead of its reading, or average its periods."
            )
            if (
                not np.median(np.abs(np.diff(run.response[use], 3)))
                > THRESHOLDS.reading_noise * run.span
            ):
                text += (
                    " The response carries no noise: its column may be swapped with the drive's."
                )
            found.append(Fault("noisy drive", run.name, text, ((0, run.drive.size - 1),)))
    return found


def _alternates(fast: np.ndarray) -> bool:
    """Whether third differences turn from each to the next, as those of white noise do (-3/4)."""
    return float(fast[1:] @ fast[:-1]) < -0.5 * float(fast @ fast)
