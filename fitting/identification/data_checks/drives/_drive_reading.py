"""Noise in the reading of a drive: its size, what a model makes of it, how to be rid of it."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._thresholds import THRESHOLDS
from rapi_jax import Recording, Run
from rapi_jax.internal import usable, white_noise_rms

WHITE = np.sqrt(20.0)  # third differences of white noise of 1: 1 + 9 + 9 + 1


@dataclasses.dataclass(frozen=True)
class DriveNoise:
    """Noise of a run's drive that its response does not follow.

    `rms`: in the drive's unit; `in_response`: what a model makes of it, in the response's unit.
    """

    run: Run
    rms: float
    in_response: float


def find_reading_noise(recording: Recording) -> list[DriveNoise]:
    """The noise of each run's drive, where it has some that is white or the steps of a converter.

    It is told from a drive that moves so by the response, which would follow: from sample to sample
    what a smooth curve through the loop leaves then has none of the drive.
    """
    found = (_measure(run, recording.response_lag_s) for run in recording.runs)
    return [one for one in found if one is not None]


def _measure(run: Run, lag_s: float) -> DriveNoise | None:
    use = np.flatnonzero(usable(run, lag_s))
    if use.size < THRESHOLDS.outlier_samples or run.drive.u_pp == 0:
        return None
    drive = run.drive.delayed(lag_s).value[use]
    smooth = smooth_response(run, lag_s)[use]
    fast, left = np.diff(drive, 3), np.diff(smooth - run.response[use], 3)
    usual = float(np.median(np.abs(fast)))
    # Of a staircase most differences are none, and its corners are no larger than its steps.
    calm = np.abs(fast) <= (THRESHOLDS.drive_noise_calm * usual if usual else np.inf)
    square = float(fast[calm] @ fast[calm])
    if calm.sum() < THRESHOLDS.outlier_samples or not square or not alternates(fast):
        return None
    slope = float(np.std(smooth) / np.std(drive))
    answered = float(fast[calm] @ left[calm]) / square  # by a smooth curve and not by the device
    if abs(answered) < THRESHOLDS.drive_noise_unanswered * slope:
        return None
    rms = _of_steps(drive) if usual == 0 else float(np.sqrt(square / calm.sum())) / WHITE
    return DriveNoise(run, rms, slope * rms)


def _of_steps(drive: Float[np.ndarray, " samples"]) -> float:
    """The rms error of a reading that is rounded to steps."""
    steps = np.abs(np.diff(drive))
    return float(np.median(steps[steps > 0])) / np.sqrt(12.0)


def smooth_response(run: Run, lag_s: float) -> Float[np.ndarray, " samples"]:
    """A cubic in the drive, nearest to the response: its value at every sample."""
    drive = run.drive.delayed(lag_s).value
    if run.drive.u_pp == 0 or run.valid.sum() < THRESHOLDS.outlier_samples:
        return np.zeros(drive.size)
    scaled = (drive - drive.mean()) / run.drive.u_pp
    columns = np.stack([scaled**power for power in range(4)], axis=1)
    return columns @ np.linalg.lstsq(columns[run.valid], run.response[run.valid], rcond=None)[0]


def quieter_response(run: Run) -> Float[np.ndarray, " samples"]:
    """The response, or what its cubic in the drive leaves of it, by which has less white noise.

    Where the response follows noise of the drive, most of that is gone. A part that is the same in
    each period goes with it, where the drive repeats.
    """
    left = run.response - smooth_response(run, 0.0)
    quieter = white_noise_rms(left[run.valid]) < white_noise_rms(run.response[run.valid])
    return left if quieter else run.response


def alternates(fast: Float[np.ndarray, " differences"]) -> bool:
    """Whether third differences turn from each to the next, as those of white noise do (-3/4)."""
    return float(fast[1:] @ fast[:-1]) < -0.5 * float(fast @ fast)


def describe_cure(run: Run) -> str:
    """What to do about noise of a drive: what an import can put in place of its readings."""
    if run.drive.repeats and run.drive.waveform in ("triangle", "sine"):
        return (
            f"Import it again with `--drive-as fitted`: the {run.drive.waveform} nearest to the "
            "readings takes their place."
        )
    if run.drive.repeats and _periods_are_alike(run):
        return (
            "Its periods are alike, so they were averaged already: write the drive that was sent "
            "in their place, or record more periods."
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


def _periods_are_alike(run: Run) -> bool:
    """Whether every period of the drive is the first once more, to the last digit."""
    value, period = run.drive.value, 1.0 / (run.drive.rate * run.drive.step_s)
    samples = round(period)
    if value.size < 2 * samples or abs(period - samples) > 1e-6 * period:
        return False
    return float(np.abs(value[samples:] - value[:-samples]).max()) <= 1e-9 * run.drive.u_pp
