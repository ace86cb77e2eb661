"""Fewer samples, by averages: what is faster than the new sampling folds down weakened."""

import dataclasses

import numpy as np

from rapi_jax.recording._run import Run

from ._thresholds import THRESHOLDS


def decimate(runs: list[Run], every: int | None, most: int) -> tuple[list[Run], list[str]]:
    """The runs with one sample for each `every`, or as few as bring all below `most` samples."""
    whole = sum(run.drive.size for run in runs)
    if every is None and whole <= most:
        return runs, []
    made, factors = [], []
    for run in runs:
        factor = every or _automatic(run, -(-whole // most))
        factors.append(factor)
        made.append(_average(run, factor))
    if max(factors) == 1:
        return runs, [
            f"{whole} samples, which the periods need to keep {THRESHOLDS.period_samples} each"
        ]
    size = sum(run.drive.size for run in made)
    shown = " to ".join(str(n) for n in dict.fromkeys((min(factors), max(factors))))
    why = "as asked" if every else f"more than {most}"
    return made, [
        f"decimated ({why}): each sample is the average of {shown}, against aliasing; "
        f"{size} of {whole} samples are left"
    ]


def _automatic(run: Run, factor: int) -> int:
    rate = run.drive.rate
    if rate:
        factor = min(
            factor, max(int(1.0 / (rate * run.drive.step_s) / THRESHOLDS.period_samples), 1)
        )
    return factor


def _average(run: Run, factor: int) -> Run:
    """Averages of `factor` samples; the clock starts at the middle of the first."""
    drive = run.drive
    count = drive.size // factor
    if factor == 1 or count < 3:
        return run

    def mean(column: np.ndarray) -> np.ndarray:
        return column[: count * factor].reshape(count, factor).mean(axis=1)

    step = drive.step_s
    fewer = dataclasses.replace(
        drive,
        time=step * factor * np.arange(count),
        value=mean(drive.value),
        start_s=drive.start_s + step * (factor - 1) / 2.0,
    )
    return dataclasses.replace(run, drive=fewer, response=mean(run.response))
