"""A recording with frequency and drive swapped: what an inverse is identified on."""

import dataclasses

import numpy as np

from fitting.identification._result import FitResult
from fitting.identification._thresholds import THRESHOLDS
from rapi_jax import DataError, Drive, Recording, Run, predict
from rapi_jax.internal import takes


@takes(recording=Recording, forward=FitResult)
def swap(recording: Recording, forward: FitResult, *, smooth: float | None = None) -> Recording:
    """`recording` with the measured frequency as drive and the drive as response.

    **Arguments:**

    - `forward`: the fit of a forward model to `recording`. It gives each run's own origin and
      drift, which are taken out, so that all runs share the origin of its `d_0`; and it stands for
      the frequency's shape.
    - `smooth`: the part of a period over which what the forward model leaves is smoothed; 2 % by
      default.

    Noise on an input is worse than on a response: each play keeps the largest of it at every turn.
    So the input is the forward model's response plus the smoothed rest of the measured one: turns,
    which the model makes, stay sharp, and what the model lacks stays in, save for details finer
    than `smooth`. Periods are averaged into one where they hold a whole number of samples, and long
    ones thinned, turns kept. Masked readings that no other period makes up for, and drives before
    the reading's latency has passed, come back as masked responses.

    **Returns** a recording with units swapped, no latency, one origin. Raises `DataError` where
    `forward` was not fitted to `recording`.

    >>> from fitting import fit, swap
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> swap(recording, result).drive_unit  # frequency in, drive out
    'GHz'
    """
    smooth = THRESHOLDS.misfit_smoothing if smooth is None else smooth
    lengths = [predicted.size for predicted in forward.predicted]
    if [run.name for run in recording.runs] != [run.name for run in forward.recording.runs] or (
        [run.drive.size for run in recording.runs] != lengths
    ):
        raise DataError(
            "the forward fit is of another recording: its runs have other names or lengths. Fit "
            "the model to this recording first."
        )
    runs = [
        _swapped(run, forward, row, recording.response_lag_s, smooth)
        for row, run in enumerate(recording.runs)
    ]
    return dataclasses.replace(
        recording,
        runs=tuple(runs),
        response_unit=recording.drive_unit,
        drive_unit=recording.response_unit,
        response_origin="session",
        response_lag_s=0.0,
    )


def _swapped(run: Run, forward: FitResult, row: int, lag_s: float, smooth: float) -> Run:
    drive = run.drive
    sent = drive.delayed(lag_s)
    modelled = forward.predicted[row]
    left = run.response - modelled
    if drive.repeats:
        shape = np.asarray(predict(forward.ecdl, sent))  # without offset and drift
        period = 1.0 / (drive.rate * drive.step_s)
        width = round(smooth * period)
    else:
        shape = modelled - forward.runs[row].offset
        period = 0.0
        width = round(smooth * drive.size / max(np.count_nonzero(np.diff(drive.up)), 1))
    reading = np.where(run.valid & (drive.time >= lag_s), sent.value, np.nan)
    if drive.repeats and drive.periods > 1 and abs(period - round(period)) * drive.periods < 0.1:
        one = slice(int(np.argmax(drive.period == 0)), None)
        one = slice(one.start, one.start + round(period))
        left = smoothed(np.tile(_folded(left[one.start :], round(period)), 3), width)
        frequency = shape[one] + left[round(period) : 2 * round(period)]
        time, reading = drive.time[one], sent.value[one]
    else:
        one = slice(None)
        frequency, time = shape + smoothed(left, width), drive.time
    keep = slice(*_thinning(shape[one], round(period)))
    time = time[keep]
    start_s = drive.start_s + float(time[0])
    swapped = Drive(time - time[0], frequency[keep], drive.excitation_hz, drive.waveform, start_s)
    return Run(swapped, reading[keep], run.name)


def _folded(value: np.ndarray, period: int) -> np.ndarray:
    """The mean over periods of `value`, NaN where no period has a number."""
    rows = np.full(-(-value.size // period) * period, np.nan)
    rows[: value.size] = value
    rows = rows.reshape(-1, period)
    count = np.isfinite(rows).sum(axis=0)
    return np.where(count > 0, np.nansum(rows, axis=0) / np.maximum(count, 1), np.nan)


def smoothed(value: np.ndarray, width: int) -> np.ndarray:
    """`value` averaged with triangular weights of half-height width `width` samples, no delay.

    Values that are not numbers have no weight; where there are no others nearby, the result is 0.
    """
    width = max(width, 1)
    kernel = np.convolve(np.ones(width), np.ones(width))
    good = np.isfinite(value)
    total = np.convolve(np.where(good, value, 0.0), kernel, "same")[: value.size]
    weight = np.convolve(good.astype(float), kernel, "same")[: value.size]
    return np.where(weight > 0.5, total / np.maximum(weight, 0.5), 0.0)


def _thinning(shape: np.ndarray, period: int) -> tuple[int, None, int]:
    """First sample, end and stride that keep the turns of the first period among the samples."""
    one = shape[:period] if period else shape
    low, high = int(np.argmin(one)), int(np.argmax(one))
    stride = max(period // THRESHOLDS.thinned_samples, 1)
    while stride > 1 and ((high - low) % stride or period % stride):
        stride -= 1
    return low % stride, None, stride
