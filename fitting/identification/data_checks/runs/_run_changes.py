"""Runs that do not belong to the others: which, and the cheapest change that makes them fit.

A change is one number for some of the runs: an offset, a gain, a shift in time, a bias of the
drive, a rate. To first order its effect on the residual is a column; the column that takes most of
the gap away, beside what the model's own parameters can do, is made good in the data, and the model
is fitted again. What remains then says whether that was it.
"""

import dataclasses

import numpy as np

from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._solution import Evaluation, Fit

from ._change import ORIGINS, Change, undo
from ._change_fault import describe_change, describe_origins
from ._gap import squared_gap, squared_gap_and_noise
from ._law_cuts import amplitude_cuts
from ._likely_changes import changes_of_groups, changes_of_one, changes_of_origin, column_range
from ._run_columns import change_columns


@np.errstate(over="ignore", invalid="ignore")  # a refit that runs away explains nothing
def find_changed_runs(
    problem: Problem, weight: np.ndarray, solution: Evaluation, fit: Fit
) -> list[Fault]:
    """The change that makes all runs fit one model, as a fault; none where there is none.

    Where no change of one number does, each run may have an origin of its own. All runs of small or
    of large swing together are not accused: there an amplitude law acts.
    """
    runs = len(problem.recording.runs)
    start, noise = squared_gap_and_noise(problem, weight, solution)
    if runs < 2 or not start > THRESHOLDS.changed_runs_gap**2 * noise:
        return []
    likely = [
        *changes_of_one(problem, weight, solution, fit),
        *changes_of_groups(problem, weight, solution),
        *changes_of_origin(problem, weight, solution, fit),
    ]
    laws = amplitude_cuts(problem.recording)
    origins = [change for change in likely if change.kind == ORIGINS]
    likely = [
        change
        for change in likely
        if change.explained >= THRESHOLDS.changed_runs_first and set(change.rows) not in laws
    ]
    best = None
    for first in (change for change in likely if change.kind != ORIGINS):
        found = _confirm(problem, weight, solution, first, start, fit)
        if found is not None and (best is None or found.explained > best.explained):
            best = found
    if best is not None and best.explained >= THRESHOLDS.changed_runs_explained:
        return [describe_change(problem.recording, best)]
    return [
        describe_origins(problem.recording, change)
        for change in origins
        if change.explained >= THRESHOLDS.changed_runs_explained
    ]


def _confirm(
    problem: Problem,
    weight: np.ndarray,
    solution: Evaluation,
    first: Change,
    start: float,
    fit: Fit,
) -> Change | None:
    """The change with its size at the optimum of model and change, and what it explains."""
    size, end = first.size, solution
    relative = first.kind in ("gain", "rate")
    for count in range(THRESHOLDS.changed_runs_rounds):
        if count:
            step = _size(now, weight, end, first)
            if abs(step) < THRESHOLDS.changed_runs_step * abs(first.size):
                break
            size = (1.0 + size) * (1.0 + step) - 1.0 if relative else size + step
        if not np.isfinite(size) or size == -1.0 or (first.kind == "rate" and size < -1.0):
            return None
        now = problem.with_recording(undo(problem.recording, dataclasses.replace(first, size=size)))
        begins = [end.start] if count else [end.start, problem.start(problem.ecdl)]
        end = min((fit(now, b, weight) for b in begins), key=_squares)
    gap = squared_gap(now, weight, end)
    return dataclasses.replace(first, size=float(size), explained=1.0 - gap / start)


def _squares(end: Evaluation) -> float:
    """What is left, weighted; infinite where a refit ran away."""
    return float(np.nan_to_num(end.squares, nan=np.inf, posinf=np.inf))


def _size(problem: Problem, weight: np.ndarray, solution: Evaluation, change: Change) -> float:
    basis = column_range(solution.jacobian)
    columns = change_columns(problem, solution, change.kind)[:, list(change.rows)].sum(axis=1)
    column = (weight * columns).ravel()
    column = column - basis @ (basis.T @ column)
    error = (weight * solution.error).ravel()
    return -float(column @ error) / max(float(column @ column), 1e-300)
