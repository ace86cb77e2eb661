"""Changes that may have happened to runs: the best of each kind, to first order."""

import dataclasses

import numpy as np
from jaxtyping import Float

from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem
from fitting.identification.problem._solution import Evaluation, Fit

from ._change import ORIGINS, Change
from ._gap import squared_gap
from ._run_columns import KINDS, change_columns


def changes_of_one(
    problem: Problem, weight: np.ndarray, solution: Evaluation, fit: Fit
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
        end = fit(problem, solution.start, others)
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


def changes_of_origin(
    problem: Problem, weight: np.ndarray, solution: Evaluation, fit: Fit
) -> list[Change]:
    """The offset of some runs, by fits in which each run has an origin of its own.

    What a model can do as well (origins that are linear in rate, say) counts as nothing; so the
    fits, from two starts, may end at other origins. None where these are free, or cannot be. Also,
    as the kind `ORIGINS`, all runs but the first with an origin of their own; its size is the range
    of these.
    """
    own = problem.with_recording(
        dataclasses.replace(problem.recording, response_origin="run"),
    )
    if problem.own_origin or not own.own_origin:
        return []
    begins = [own.whole_vector(solution.own), own.start(own.ecdl)]
    ends = [fit(own, begin, weight) for begin in begins]
    best = min(ends, key=lambda end: end.squares)
    gap = max(squared_gap(problem, weight, solution), 1e-300)
    size = float(np.ptp(best.values[own.vector.size : own.vector.size + own.offsets]))
    explained = 1.0 - squared_gap(own, weight, best) / gap
    each = Change(ORIGINS, tuple(range(1, own.offsets)), size, explained)
    return [each, *(change for end in ends for change in _best_offset(own, end))]


def _best_offset(own: Problem, end: Evaluation) -> list[Change]:
    """The group of runs whose common offset explains most of what their origins at `end` do."""
    at = np.arange(own.vector.size, own.vector.size + own.offsets)
    origins, jacobian = end.values[at], end.jacobian
    if not np.isfinite(jacobian).all():
        return []
    basis = column_range(np.delete(jacobian, at, axis=1))
    columns = jacobian[:, at] - basis @ (basis.T @ jacobian[:, at])
    gram = columns.T @ columns
    along, whole = gram @ origins, max(float(origins @ gram @ origins), 1e-300)
    found = []
    for rows in _groups(gram, along, single=False):
        square = float(rows @ gram @ rows)
        if square > THRESHOLDS.changed_runs_rank * float(np.trace(gram)):
            size = float(rows @ along) / square
            chosen = tuple(np.flatnonzero(rows).tolist())
            found.append(Change("offset", chosen, size, size**2 * square / whole))
    return sorted(found, key=lambda change: change.explained)[-1:]


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
