"""Recordings of millions of samples, thinned to what a fit can use and a machine can hold."""

import dataclasses

import numpy as np

from fitting.identification._thresholds import THRESHOLDS as FITTING
from rapi_jax import Recording, Run
from rapi_jax.internal import turning_places

from ._thresholds import THRESHOLDS


def thin(recording: Recording) -> tuple[Recording, str | None]:
    """The recording with at most so many samples as a fit looks at, and a note on what was left.

    Every n-th sample is kept, of whole periods those that divide them where there are such, and at
    least 500 a period; of a drive that turns densely fewer in all. Where that is not enough, runs
    that repeat are cut after whole periods. The note is `None`, and the recording the same, where
    nothing is left out.
    """
    whole = _samples(recording)
    dense = turns_densely(recording)
    most = THRESHOLDS.dense_fitted_samples if dense else THRESHOLDS.fitted_samples
    if whole <= most:
        return recording, None
    runs = [_thin_run(run, -(-whole // most)) for run in recording.runs]
    size = sum(run.drive.size for run in runs)
    cut = 0
    if size > most:
        share = most / size
        runs = [_cut_run(run, share) for run in runs]
        cut, size = size, sum(run.drive.size for run in runs)
    every = sorted(
        {round(a.drive.step_s / b.drive.step_s) for a, b in zip(runs, recording.runs, strict=True)}
    )
    steps = " to ".join(str(n) for n in dict.fromkeys((every[0], every[-1])))
    what = "drive that turns every few samples" if dense else "long recording"
    note = f"{what}: of {whole} samples the fit used {size}, one in {steps}"
    note += ", of the first periods of each run" if cut > size else ""
    note += ". Errors are those of the samples used; the model holds for all."
    return dataclasses.replace(recording, runs=tuple(runs)), note


def turns_densely(recording: Recording) -> bool:
    """Whether a drive turns every few samples, as one with noise does, in many samples."""
    return _samples(recording) > THRESHOLDS.dense_samples and has_dense_turns(recording)


def has_dense_turns(recording: Recording) -> bool:
    """Whether a drive turns every few samples, in however many.

    Plays over few monotone stretches of a drive are summed in closed form; where nearly each sample
    turns, all of them are stepped through, which takes about 100 times as long.
    """
    return any(
        run.drive.size < THRESHOLDS.dense_turn * turning_places(run.drive.value).size
        for run in recording.runs
    )


def _samples(recording: Recording) -> int:
    return sum(run.drive.size for run in recording.runs)


def _thin_run(run: Run, every: int) -> Run:
    drive = run.drive
    if drive.repeats:
        exact = 1.0 / (drive.rate * drive.step_s)
        every = min(every, max(int(exact // FITTING.thinned_samples), 1))
        whole = drive.whole_period
        divide = [k for k in range(every, 2 * every) if whole and whole % k == 0]
        if divide and exact / divide[0] >= FITTING.thinned_samples:
            every = divide[0]
    if every == 1:
        return run
    kept = slice(None, None, every)
    fewer = dataclasses.replace(drive, time=drive.time[kept], value=drive.value[kept])
    return dataclasses.replace(run, drive=fewer, response=run.response[kept])


def _cut_run(run: Run, share: float) -> Run:
    """The first periods of a run that repeats, at least two, and what is before the first."""
    drive = run.drive
    if not drive.repeats or drive.periods <= 2:
        return run
    periods = max(2, int(share * drive.periods))
    last = int(np.flatnonzero(drive.period == periods - 1)[-1])
    kept = slice(0, min(last + 2, drive.size))
    fewer = dataclasses.replace(drive, time=drive.time[kept], value=drive.value[kept])
    return dataclasses.replace(run, drive=fewer, response=run.response[kept])
