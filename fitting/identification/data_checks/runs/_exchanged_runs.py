"""Readings in another place: copied from a run, exchanged between runs, or in reverse order."""

import dataclasses
from itertools import combinations

import numpy as np

from fitting.identification._starts import candidates
from fitting.identification._thresholds import THRESHOLDS as FITTING
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._solution import Evaluation, Fit
from rapi_jax import Recording, Run
from rapi_jax.internal import waveform_miss

from ._backward_cause import describe_backward
from ._gap import squared_gap, squared_gap_and_noise
from ._orders import likeliest_orders, reordered, same_drive


def find_copied_readings(recording: Recording) -> list[Fault]:
    """Runs with equal readings, noise included, under different drives."""
    found = []
    for one, other in combinations(recording.runs, 2):
        if not _has_noise(one.response) or waveform_miss(one, one.response) < FITTING.exact_fit:
            continue  # a command may be the same in several runs
        if _same_readings(one, other) and not same_drive(one, other):
            text = (
                f"runs {one.name!r} and {other.name!r} hold the same readings, noise included, "
                "under different drives: one was copied over the other. Give each run its own."
            )
            found.append(Fault("copied readings", other.name, text, ((0, other.drive.size - 1),)))
    return found


def _has_noise(reading: np.ndarray) -> bool:
    """Whether it changes from sample to sample; a commanded one, or none at all, may be equal."""
    values = reading[np.isfinite(reading)]
    if values.size < 4:
        return False
    fast = float(np.median(np.abs(np.diff(values, 3))))
    return fast > FITTING.exact_fit * float(np.ptp(values))


def _same_readings(one: Run, other: Run) -> bool:
    same = one.drive.size == other.drive.size
    return same and np.array_equal(one.response, other.response, equal_nan=True)


@np.errstate(over="ignore", invalid="ignore")  # a refit that runs away explains nothing
def find_exchanged_runs(
    problem: Problem, weight: np.ndarray, solution: Evaluation, fit: Fit
) -> list[Fault]:
    """The order of the readings in which all runs fit one model, where they do not as they are."""
    start, noise = squared_gap_and_noise(problem, weight, solution)
    if not start > THRESHOLDS.changed_runs_gap**2 * noise:
        return []
    best, order = start, ()
    for new in likeliest_orders(problem, weight, solution)[: THRESHOLDS.fitted_orders]:
        other = problem.with_recording(reordered(problem.recording, new))
        # From a first guess: the end may rest at a bound, where exchanged runs have sent it.
        _, model = next(candidates(problem.ecdl, other.recording, 1))
        gap = squared_gap(other, weight, fit(other, other.start(model), weight))
        if gap < best:
            best, order = gap, new
    if 1.0 - best / start < THRESHOLDS.changed_runs_explained:
        return []
    return [_exchange_fault(problem.recording, order, 1.0 - best / start)]


def _exchange_fault(recording: Recording, order: tuple[int, ...], explained: float) -> Fault:
    runs = recording.runs
    moved = [i for i, place in enumerate(order) if i != place]
    told = ", ".join(
        f"run {runs[i].name!r} has the readings of {runs[order[i]].name!r}" for i in moved
    )
    text = (
        f"the readings of runs are exchanged. One model fits all runs, and explains "
        f"{100 * explained:.0f} % of the mean-square gap that is left now, if {told}. Exchange "
        "them so."
    )
    places = tuple((0, runs[i].drive.size - 1) for i in moved)
    return Fault("exchanged runs", runs[moved[0]].name, text, places)


@np.errstate(over="ignore", invalid="ignore")  # a refit that runs away explains nothing
def find_reversed_time(
    problem: Problem, weight: np.ndarray, solution: Evaluation, fit: Fit
) -> list[Fault]:
    """A recording of which nearly all that is left goes where its samples are read backwards.

    Exchanged columns and a wrong sign of the response look so, too: `describe_backward` tells them.
    """
    start, noise = squared_gap_and_noise(problem, weight, solution)
    if not start > THRESHOLDS.changed_runs_gap**2 * noise:
        return []
    other = problem.with_recording(backwards(problem.recording))
    _, model = next(candidates(problem.ecdl, other.recording, 1))
    again = other.weights(weight.max(axis=1) ** 2)
    gap = squared_gap(other, again, fit(other, other.start(model), again))
    explained = 1.0 - gap / start
    if explained < THRESHOLDS.changed_runs_explained:
        return []
    run = problem.recording.runs[0]
    kind, text = describe_backward(problem.recording, explained)
    return [Fault(kind, run.name, text, ((0, run.drive.size - 1),))]


def backwards(recording: Recording) -> Recording:
    """The recording with the samples of each run in reverse order, on a clock from 0."""
    return dataclasses.replace(recording, runs=tuple(_backwards(run) for run in recording.runs))


def _backwards(run: Run) -> Run:
    time = (run.drive.time[-1] - run.drive.time)[::-1].copy()
    drive = dataclasses.replace(run.drive, time=time, value=run.drive.value[::-1].copy())
    return dataclasses.replace(run, drive=drive, response=run.response[::-1].copy())
