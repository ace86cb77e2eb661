"""What a recording holds and how long the work on it takes, in a line before it begins."""

import dataclasses
import math
from typing import Any, Literal

from rapi_jax.internal import threshold

Work = Literal["fit", "diagnose"]
_COUNTS = ("no", "one", "two", "three", "four", "five")


@dataclasses.dataclass(frozen=True)
class TimeThresholds:
    """What an estimate of the time is made of."""

    fit_s: float = threshold(
        18.0,
        unit="s of one core",
        origin="measured by `rapi fit` on six simulated recordings of 1 to 10 runs and 1200 to "
        "800 000 samples: 23 to 61 s of processor time with `--no-compile-cache`, 16 to 34 s with "
        "the programs of an earlier fit. All twelve are within a factor of 1.9 of the estimate; of "
        "half or twice as much two or five are not within two",
    )
    fit_s_per_run: float = threshold(
        2.4,
        unit="s of one core a run",
        origin="from the same fits; at half of it one of twelve is not within a factor of two, at "
        "twice two",
    )
    fit_s_per_sample: float = threshold(
        1e-5, unit="s/sample", origin="from the same fits: 800 000 samples take 7 s more than 9600"
    )
    dense_fit_s_per_sample: float = threshold(
        4e-3,
        unit="s/sample",
        origin="measured: 20 000 samples of a drive that turns every few take 91 s in a cold "
        "process, of processor time, and 9600 take 68 s",
    )
    diagnose_s: float = threshold(
        26.0,
        unit="s of one core",
        origin="measured by `rapi diagnose --no-compile-cache` on seven simulated recordings of 1 "
        "to 10 runs and 1200 to 800 000 samples: 24 to 36 s of processor time, all within a "
        "factor of 1.4 of the estimate; of half or twice as much four or two are not within two",
    )
    diagnose_s_per_sample: float = threshold(
        1e-4,
        unit="s/sample used",
        origin="measured: 24 s for 4500 samples and 34 s for 25 600; half or twice as much moves "
        "no estimate by more than a tenth",
    )
    diagnose_longest: float = threshold(
        9.0,
        unit="times",
        origin="measured: single periods of two ferroelectrics, 3000 and 4000 samples that no "
        "operator describes exactly, took 2.5 and 9 times the estimate of processor time",
    )


THRESHOLDS = TimeThresholds()


def estimate_seconds(recording: Any, work: Work) -> float:
    """About how long `work` on `recording` takes in a process that has done none yet, s."""
    from fitting.diagnosis.noise._periods import decimate
    from fitting.identification.data_checks._thinning import has_dense_turns, thin

    if work == "diagnose":
        used = sum(run.drive.size for run in decimate(recording).runs)
        return THRESHOLDS.diagnose_s + THRESHOLDS.diagnose_s_per_sample * used
    samples = sum(run.drive.size for run in recording.runs)
    fit = THRESHOLDS.fit_s + THRESHOLDS.fit_s_per_run * len(recording.runs)
    fit += THRESHOLDS.fit_s_per_sample * samples
    if has_dense_turns(recording):
        fitted = sum(run.drive.size for run in thin(recording)[0].runs)
        fit += THRESHOLDS.dense_fit_s_per_sample * fitted
    return fit


def describe_recording(
    recording: Any, seconds: float, longest: float | None = None, *, usual: bool = True
) -> str:
    """Such as `5 runs of 4 periods at 10 to 40 Hz, two swings, noise 20 MHz rms; about 30 s`.

    `longest`: what it takes at most, s, of a device that no model describes. `usual`: whether the
    options are those with which times were measured.
    """
    import numpy as np

    from fitting._units import quantity
    from fitting.identification.data_checks.periods._odd_periods import find_late_starts
    from fitting.recording_check._runs import RunSummary

    runs = recording.runs
    text = f"{len(runs)} run{'s' if len(runs) != 1 else ''}"
    periods = sorted({run.drive.periods for run in runs})
    if periods != [0]:
        text += f" of {_between(periods)} period{'s' if periods[-1] != 1 else ''}"
    rates = recording.rates
    if rates[-1] > 0:
        text += f" at {_between(rates)} Hz"
    swings = len(recording.amplitudes)
    text += f", {_COUNTS[swings] if swings < len(_COUNTS) else swings} swing"
    text += "s" if swings != 1 else ""
    if all(run.valid.any() for run in runs):
        late, lag = find_late_starts(runs), recording.response_lag_s
        noise = [RunSummary.of(run, lag, settled=run.name not in late).noise for run in runs]
        whole = float(np.sqrt(np.mean(np.square(noise))))
        text += f", noise {quantity(float(f'{whole:.2g}'), recording.response_unit)} rms"
    more = "" if longest is None else f", up to {_round_seconds(longest)} where no model fits"
    with_what = "" if usual else " with the default options"
    return f"{text}; about {_round_seconds(seconds)}{with_what}{more}"


def _between(values: Any) -> str:
    low, high = f"{values[0]:g}", f"{values[-1]:g}"
    return low if low == high else f"{low} to {high}"


def _round_seconds(seconds: float) -> str:
    if seconds < 90:
        return f"{max(5, 5 * math.ceil(seconds / 5)):d} s"
    return f"{round(seconds / 60):d} minutes"
