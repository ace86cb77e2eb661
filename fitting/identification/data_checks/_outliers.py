"""Single readings far from their neighbours: found in a residual, left out, and listed."""

import dataclasses

import numpy as np
from jaxtyping import Bool, Float, Int
from numpy.lib.stride_tricks import sliding_window_view

from fitting.identification.problem._problem import Problem
from rapi_jax import Recording, Run

from ._data_checks import find_faults
from ._fault import Fault, format_intervals
from ._step_detection import nearby
from ._thresholds import THRESHOLDS

Places = tuple[Bool[np.ndarray, "_"], ...]  # one per run, of its own length


def plain_faults(problem: Problem) -> list[Fault]:
    """`find_faults` of the problem's recording, looked for once."""
    if "plain faults" not in problem.kept:
        problem.kept["plain faults"] = find_faults(problem.recording)
    return problem.kept["plain faults"]


def find_outliers(problem: Problem, error: Float[np.ndarray, "runs time"]) -> Places:
    """Which readings of each run stand far from those before and from those after.

    A reading is compared with the medians of the three before it and of the three after it, less
    what the model says, in units of what is usual in its run. A misfit is smooth but where the
    response turns, a jump has one side only, and what comes back in each period is no accident:
    none of these is an outlier. Runs with plain faults have none.
    """
    data = problem.data
    span = max(float(np.ptp(data.y[row, use])) for row, use in enumerate(data.use))
    faulty = {fault.run for fault in plain_faults(problem)}
    found = []
    for row, run in enumerate(problem.recording.runs):
        out = np.zeros(run.drive.size, dtype=bool)
        index = np.flatnonzero(data.use[row])
        if index.size >= THRESHOLDS.outlier_samples and run.name not in faulty:
            apart = _apart(error[row, index])
            usual = 1.4826 * float(np.median(apart))
            smallest = max(THRESHOLDS.outlier_size * usual, THRESHOLDS.outlier_least * span)
            said = error[row, index] + data.y[row, index]
            motion = nearby(np.abs(np.diff(said, prepend=said[0])), 3)
            least = np.maximum(smallest, THRESHOLDS.outlier_motion * motion)
            found_here = _sudden(error[row, index], np.flatnonzero(apart > least), smallest / 2.0)
            out[_once(problem.data.sample[row, index[found_here]], run)] = True
        found.append(out)
    return tuple(found)


def _apart(error: Float[np.ndarray, " samples"]) -> Float[np.ndarray, " samples"]:
    """How far each value lies from both its sides; 0 where it lies between them."""
    windows = sliding_window_view(error, 7)
    middle = windows[:, 3]
    before, after = (middle - np.median(windows[:, k : k + 3], axis=1) for k in (0, 4))
    out = np.zeros(error.size)  # the first and the last three have one side only
    out[3:-3] = np.where(before * after > 0, np.minimum(np.abs(before), np.abs(after)), 0.0)
    return out


def _once(places: Int[np.ndarray, "_"], run: Run) -> Int[np.ndarray, "_"]:
    """Those whose phase, to a sample, is not that of others in most of the other periods."""
    drive = run.drive
    if not drive.repeats or places.size < 2:
        return places
    step = drive.rate * drive.step_s
    phase = (drive.time[places] * drive.rate) % 1.0
    apart = np.abs(phase[:, None] - phase[None, :])
    apart = np.minimum(apart, 1.0 - apart)
    period = drive.period[places]
    others = [(period == p) & (period[:, None] != p) for p in np.unique(period)]
    met = sum(((apart < 1.5 * step) & other).any(axis=1).astype(int) for other in others)
    return places[2 * met <= max(drive.periods - 1, 1)]


def _sudden(
    error: Float[np.ndarray, " samples"], places: Int[np.ndarray, "_"], least: float
) -> Int[np.ndarray, "_"]:
    """Those alone or in pairs, which the error jumps to, and back from."""
    kept = [places[:0]]
    for group in np.split(places, np.flatnonzero(np.diff(places) > 1) + 1):
        if 0 < group.size <= 2:
            first, last = int(group[0]), int(group[-1])
            steps = error[first] - error[first - 1], error[last] - error[last + 1]
            if min(np.abs(steps)) > least:
                kept.append(group)
    return np.concatenate(kept)


def few_outliers(outliers: Places) -> Places:
    """The same without runs of which more than a small share would be left out."""
    limit = THRESHOLDS.outlier_share
    return tuple(out & (out.mean() <= limit) for out in outliers)


def leave_out(recording: Recording, outliers: Places) -> Recording:
    """The recording with these readings masked."""
    runs = tuple(
        dataclasses.replace(run, response=np.where(out, np.nan, run.response)) if out.any() else run
        for run, out in zip(recording.runs, outliers, strict=True)
    )
    return dataclasses.replace(recording, runs=runs)


def report_outliers(recording: Recording, cleaned: Recording, outliers: Places) -> list[Fault]:
    """The readings that `cleaned` leaves out, and the `outliers` that it holds: too many."""
    found = []
    for run, other, out in zip(recording.runs, cleaned.runs, outliers, strict=True):
        gone, more = run.valid & ~other.valid, out & (out.mean() > THRESHOLDS.outlier_share)
        for places, few in ((np.flatnonzero(gone), True), (np.flatnonzero(more), False)):
            if not places.size:
                continue
            samples = tuple((int(i), int(i)) for i in places)
            many = "s" * (places.size > 1)
            end = (
                "Left out of the fit."
                if few
                else "So many are no accident: check the readout, and record again."
            )
            text = (
                f"run {run.name!r}: {places.size} reading{many} far from those before and after "
                f"(sample{many} {format_intervals(list(samples))}; the first is "
                f"{run.response[places[0]]:.4g} {recording.response_unit}). {end}"
            )
            found.append(Fault("outliers", run.name, text, samples, left_out=few))
    return found
