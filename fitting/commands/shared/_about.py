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
        7.0, unit="s", origin="measured, two cores: a first fit of 20 000 samples, compilation too"
    )
    fit_s_per_sample: float = threshold(
        7.5e-6, unit="s/sample", origin="measured: 400 000 samples take 3 s more than 20 000"
    )
    dense_fit_s_per_sample: float = threshold(
        4e-3,
        unit="s/sample",
        origin="measured: 20 000 samples of a drive that turns every few take 91 s in a cold "
        "process, of processor time",
    )
    diagnose_s: float = threshold(
        18.0, unit="s", origin="measured, two cores: a first diagnosis, compilation too"
    )
    diagnose_s_per_sample: float = threshold(
        1e-4, unit="s/sample", origin="measured: 21 s for 31 200 samples in a cold process"
    )
    diagnose_longest: float = threshold(
        9.0,
        unit="times",
        origin="measured: single periods of two ferroelectrics, 3000 and 4000 samples that no "
        "operator describes exactly, took 2.5 and 9 times the estimate of processor time",
    )


THRESHOLDS = TimeThresholds()


def estimate_seconds(recording: Any, work: Work) -> float:
    """About how long `work` on `recording` takes in a process that has compiled nothing yet, s."""
    from fitting.identification.data_checks._thinning import thin, turns_densely

    samples = sum(run.drive.size for run in recording.runs)
    fit = THRESHOLDS.fit_s + THRESHOLDS.fit_s_per_sample * samples
    if turns_densely(recording):
        fitted = sum(run.drive.size for run in thin(recording)[0].runs)
        fit += THRESHOLDS.dense_fit_s_per_sample * fitted
    if work == "fit":
        return fit
    return THRESHOLDS.diagnose_s + THRESHOLDS.diagnose_s_per_sample * samples


def describe_recording(recording: Any, seconds: float, longest: float | None = None) -> str:
    """Such as `5 runs of 4 periods at 10 to 40 Hz, two swings, noise 20 MHz rms; about 30 s`.

    `longest`: what it may take, s, where that is more.
    """
    import numpy as np

    from fitting._units import quantity
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
        noise = [RunSummary.of(run, recording.response_lag_s).noise for run in runs]
        whole = float(np.sqrt(np.mean(np.square(noise))))
        text += f", noise {quantity(float(f'{whole:.2g}'), recording.response_unit)} rms"
    more = "" if longest is None else f" to {_round_seconds(longest)}"
    return f"{text}; about {_round_seconds(seconds)}{more}"


def _between(values: Any) -> str:
    low, high = f"{values[0]:g}", f"{values[-1]:g}"
    return low if low == high else f"{low} to {high}"


def _round_seconds(seconds: float) -> str:
    if seconds < 90:
        return f"{max(5, 5 * math.ceil(seconds / 5)):d} s"
    return f"{round(seconds / 60):d} minutes"
