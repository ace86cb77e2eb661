"""Runs that do not belong to the others: which, and the cheapest change that makes them fit.

A change is one number for some of the runs: an offset, a gain, a shift in time, a bias of the
drive, a rate. To first order its effect on the residual is a column; the column that takes most of
the gap away, beside what the model's own parameters can do, is made good in the data, and the model
is fitted again. What remains then says whether that was it.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from fitting.identification.assessment._noise import measure_noise
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem, Solution
from fitting.identification.problem._solution import Evaluation
from fitting.solver._least_squares import SolverOptions
from rapi_jax import Drive, Recording, Run

from ._run_columns import KINDS, change_columns

DIFFERS_WITH_RATE = "differs with rate"


@dataclasses.dataclass(frozen=True)
class Change:
    """One change of some runs: `size` is in the unit of its kind, as the runs differ from others.

    `explained`: the share of the squared gap that goes with it.
    """

    kind: str
    rows: tuple[int, ...]
    size: float
    explained: float


def find_changed_runs(
    problem: Problem, weight: np.ndarray, solution: Solution, options: SolverOptions
) -> list[Fault]:
    """The change that makes all runs fit one model, as a fault; none where there is none.

    All runs of small or of large swing together are not accused: there an amplitude law acts.
    """
    runs = len(problem.recording.runs)
    start, noise = squared_gap_and_noise(problem, weight, solution)
    if runs < 2 or not start > THRESHOLDS.changed_runs_gap**2 * noise:
        return []
    likely = [
        *_changes_of_one(problem, weight, solution, options),
        *changes_of_groups(problem, weight, solution),
    ]
    laws = amplitude_cuts(problem.recording)
    likely = [
        change
        for change in likely
        if change.explained >= THRESHOLDS.changed_runs_first and set(change.rows) not in laws
    ]
    best = None
    for first in likely:
        found = _confirm(problem, weight, solution, first, start, options)
        if found is not None and (best is None or found.explained > best.explained):
            best = found
    if best is None or best.explained < THRESHOLDS.changed_runs_explained:
        return []
    return [_fault(problem.recording, best)]


def amplitude_cuts(recording: Recording) -> list[set[int]]:
    """The runs below each amplitude, and above: what differs there may be a law of the device."""
    swings = np.array([drive.u_pp for drive in recording.drives])
    cuts = []
    for level in recording.amplitudes[1:]:
        small = swings < level / 1.01
        cuts += [set(np.flatnonzero(side).tolist()) for side in (small, ~small)]
    return cuts


def _rate_cuts(recording: Recording) -> list[set[int]]:
    """The runs below each rate, and above: what differs there may be a law of the device, too."""
    rates = np.array([drive.rate for drive in recording.drives])
    cuts = []
    for level in sorted(recording.rates)[1:]:
        slow = rates < level / 1.01
        cuts += [set(np.flatnonzero(side).tolist()) for side in (slow, ~slow)]
    return cuts


def squared_gap_and_noise(
    problem: Problem, weight: np.ndarray, solution: Evaluation
) -> tuple[float, float]:
    """Weighted sums of squares beyond the noise, and of the noise."""
    whole = float(np.sum((weight * solution.error) ** 2))
    noise = float(np.sum(weight**2 * measure_noise(problem, solution.error).rms[:, None] ** 2))
    return max(whole - noise, 0.0), noise


def squared_gap(problem: Problem, weight: np.ndarray, solution: Evaluation) -> float:
    """Weighted sum of squares beyond the noise."""
    return squared_gap_and_noise(problem, weight, solution)[0]


def _changes_of_one(
    problem: Problem, weight: np.ndarray, solution: Solution, options: SolverOptions
) -> list[Change]:
    """For each kind the best change of one run, by a model of the others: right if large, too.

    `explained` is of that run's error by this model.
    """
    found: dict[str, Change] = {}
    for row in range(weight.shape[0]):
        others = weight.copy()
        others[row] = 0.0
        if (others > 0).sum() <= problem.free_count:
            continue
        end = problem.solve(solution.start, others, options)
        error = weight[row] * end.error[row]
        for kind in KINDS:
            column = weight[row] * change_columns(problem, end, kind)[row, row]
            square = float(column @ column)
            if square > 0 and np.isfinite(square):
                size = -float(column @ error) / square
                share = size**2 * square / max(float(error @ error), 1e-300)
                if kind not in found or share > found[kind].explained:
                    found[kind] = Change(kind, (row,), size, share)
    return list(found.values())


def changes_of_groups(problem: Problem, weight: np.ndarray, solution: Evaluation) -> list[Change]:
    """For each kind the change that explains most of the gap to first order."""
    error = (weight * solution.error).ravel()
    basis = column_range(solution.jacobian)
    left = error - basis @ (basis.T @ error)
    gap = max(squared_gap(problem, weight, solution), 1e-300)
    found = []
    for kind in KINDS:
        best = None
        columns = (weight[:, None, :] * change_columns(problem, solution, kind)).transpose(0, 2, 1)
        columns = columns.reshape(weight.size, -1)
        whole = float(np.sum(columns**2))
        columns = columns - basis @ (basis.T @ columns)
        gram, along = columns.T @ columns, columns.T @ left
        for rows in _groups(gram, along, single=kind in ("shift", "rate")):
            square = float(rows @ gram @ rows)
            if square <= THRESHOLDS.changed_runs_rank * whole:
                continue
            size = -float(rows @ along) / square
            explained = size**2 * square / gap
            if best is None or explained > best.explained:
                best = Change(kind, tuple(np.flatnonzero(rows).tolist()), size, explained)
        found += [] if best is None else [best]
    return found


def _groups(
    gram: Float[np.ndarray, "runs runs"], along: Float[np.ndarray, " runs"], *, single: bool
) -> list[Float[np.ndarray, " runs"]]:
    """Runs that may have changed together: each alone, and the runs ranked by change, cut in two.

    `single`: each alone only.
    """
    runs = along.size
    found = list(np.eye(runs))
    if not single:
        free = np.linalg.lstsq(gram, along, rcond=THRESHOLDS.changed_runs_rank)[0]
        order = np.argsort(free)
        for count in range(2, runs - 1):
            rows = np.zeros(runs)
            rows[order[:count]] = 1.0
            found.append(rows)
    return found


def column_range(
    jacobian: Float[np.ndarray, "samples values"],
) -> Float[np.ndarray, "samples rank"]:
    """An orthonormal basis of the columns."""
    length = np.linalg.norm(jacobian, axis=0)
    columns = jacobian[:, length > 0] / length[length > 0]
    left, size, _ = np.linalg.svd(columns, full_matrices=False)
    return left[:, size > THRESHOLDS.changed_runs_rank * size.max(initial=0.0)]


def _confirm(
    problem: Problem,
    weight: np.ndarray,
    solution: Solution,
    first: Change,
    start: float,
    options: SolverOptions,
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
        end = min((now.solve(b, weight, options) for b in begins), key=lambda one: one.cost)
    gap = squared_gap(now, weight, end)
    return dataclasses.replace(first, size=float(size), explained=1.0 - gap / start)


def _size(problem: Problem, weight: np.ndarray, solution: Solution, change: Change) -> float:
    basis = column_range(solution.jacobian)
    columns = change_columns(problem, solution, change.kind)[:, list(change.rows)].sum(axis=1)
    column = (weight * columns).ravel()
    column = column - basis @ (basis.T @ column)
    error = (weight * solution.error).ravel()
    return -float(column @ error) / max(float(column @ column), 1e-300)


def undo(recording: Recording, change: Change) -> Recording:
    """The recording with the change taken back in its runs."""
    runs = list(recording.runs)
    for row in change.rows:
        run = runs[row]
        runs[row] = _UNDO[change.kind](run, change.size)
    return dataclasses.replace(recording, runs=tuple(runs))


def _redriven(run: Run, **changes: object) -> Run:
    return dataclasses.replace(run, drive=dataclasses.replace(run.drive, **changes))


def _earlier(run: Run, size: float) -> Run:
    time, y = run.drive.time, run.response
    return dataclasses.replace(run, response=np.interp(time - size, time, y))


def _rescaled_rate(run: Run, size: float) -> Run:
    drive: Drive = run.drive
    factor = 1.0 + size
    rate = None if drive.excitation_hz is None else drive.excitation_hz * factor
    return _redriven(run, time=drive.time / factor, excitation_hz=rate)


_UNDO: dict[str, Callable[[Run, float], Run]] = {
    "offset": lambda run, size: dataclasses.replace(run, response=run.response - size),
    "gain": lambda run, size: dataclasses.replace(run, response=run.response / (1.0 + size)),
    "shift": _earlier,
    "bias": lambda run, size: _redriven(run, value=run.drive.value + size),
    "rate": _rescaled_rate,
}


def _fault(recording: Recording, change: Change) -> Fault:
    """The change in words; of two groups the smaller one is named.

    Runs that are all of those above or below a rate may differ by a law of the device: another
    dependence of its hysteresis on rate, a lag, a resonance. Nothing in the data tells.
    """
    rows, size = change.rows, change.size
    others = tuple(i for i in range(len(recording.runs)) if i not in rows)
    if len(others) < len(rows):
        rows = others
        size = 1.0 / (1.0 + size) - 1.0 if change.kind in ("gain", "rate") else -size
    names = ", ".join(repr(recording.runs[i].name) for i in rows)
    y, u = recording.response_unit, recording.drive_unit
    text = {
        "offset": f"the readings lie {size:+.3g} {y} from where the other runs have them. If runs "
        'have no common zero, say `response_origin = "run"`',
        "gain": f"the readings are {1.0 + size:.4g} times as large as in the other runs: another "
        "device, scale or unit",
        "shift": f"the response comes {1e3 * abs(size):.3g} ms {'early' if size > 0 else 'late'} "
        "beside the other runs: a trigger or clock",
        "bias": f"the drive that fits the other runs is {size:+.3g} {u} from the one written: a "
        "bias written wrong",
        "rate": f"the run behaves as if its rate were {100 * size:+.3g} % from the one written: a "
        "wrong clock or rate, or the response of another run",
    }[change.kind]
    lawful = set(rows) in _rate_cuts(recording) and (
        change.kind in ("shift", "rate")
        or (
            change.kind == "gain"
            and 1.0 / THRESHOLDS.lawful_gain < 1.0 + size < THRESHOLDS.lawful_gain
        )
    )
    those = "these runs" if rows[1:] else "this run"
    doubt = (
        " No other run has such a rate: it may be the device that differs there; record another."
    )
    return Fault(
        DIFFERS_WITH_RATE if lawful else "run does not belong",
        recording.runs[rows[0]].name,
        f"run{'s' * (len(rows) > 1)} {names}: {text}. That alone explains "
        f"{100 * min(change.explained, 1.0):.0f} % of what one model for all runs leaves. Correct "
        f"it, or leave {those} out.{doubt if lawful else ''}",
        tuple((0, recording.runs[i].drive.size - 1) for i in rows),
    )
