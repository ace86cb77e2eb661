"""Recordings that run backwards: hysteresis follows its drive, and does not foretell it."""

import dataclasses

import numpy as np

from fitting.identification._problem import Problem, Solution
from fitting.identification._starts import candidates
from fitting.solver._least_squares import SolverOptions
from rapi_jax import Recording, Run

from ._data_checks import Fault
from ._run_changes import squared_gap, squared_gap_and_noise
from ._thresholds import THRESHOLDS


def find_reversed_time(
    problem: Problem, weight: np.ndarray, solution: Solution, options: SolverOptions
) -> list[Fault]:
    """A recording of which nearly all that is left goes where its samples are read backwards."""
    start, noise = squared_gap_and_noise(problem, weight, solution)
    if not start > THRESHOLDS.changed_runs_gap**2 * noise:
        return []
    other = problem.with_recording(backwards(problem.recording))
    _, model = next(candidates(problem.ecdl, other.recording, 1))
    again = other.weights(weight.max(axis=1) ** 2)
    gap = squared_gap(other, again, other.solve(other.start(model), again, options))
    explained = 1.0 - gap / start
    if explained < THRESHOLDS.changed_runs_explained:
        return []
    run = problem.recording.runs[0]
    text = (
        f"run {run.name!r}, as all runs: the response comes before the drive that causes it. Read "
        f"backwards the samples fit a model, which explains {100 * explained:.0f} % of what is "
        "left: their order is reversed. Turn it round."
    )
    return [Fault("reversed time", run.name, text, ((0, run.drive.size - 1),))]


def backwards(recording: Recording) -> Recording:
    """The recording with the samples of each run in reverse order, on a clock from 0."""
    return dataclasses.replace(recording, runs=tuple(_backwards(run) for run in recording.runs))


def _backwards(run: Run) -> Run:
    time = (run.drive.time[-1] - run.drive.time)[::-1].copy()
    drive = dataclasses.replace(run.drive, time=time, value=run.drive.value[::-1].copy())
    return dataclasses.replace(run, drive=drive, response=run.response[::-1].copy())
