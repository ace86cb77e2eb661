"""Whether runs may be changed, exchanged or reversed, told from one model without fitting another.

Each of the searches for them fits the model anew many times. An effect of the device that the model
does not have leaves far less than exchanged or reversed readings do, and no change of single runs
takes most of it away.
"""

import numpy as np

from fitting.identification.data_checks._thresholds import THRESHOLDS
from fitting.identification.problem._solution import Evaluation

from ._exchanged_runs import backwards
from ._gap import squared_gap_and_noise
from ._law_cuts import amplitude_cuts
from ._likely_changes import changes_of_groups
from ._orders import orders
from ._run_columns import KINDS, change_columns


def may_be_changed(model: Evaluation) -> bool:
    """Whether one change of some runs explains much of the gap, to first order.

    Or nearly all errors of one run, by a model of the others: where the change is large.
    """
    if not _leaves_a_gap(model):
        return False
    laws = amplitude_cuts(model.problem.recording)
    found = changes_of_groups(model.problem, model.weight, model)
    explained = max((c.explained for c in found if set(c.rows) not in laws), default=0.0)
    return (
        explained >= THRESHOLDS.changed_runs_first or _explained_of_one(model) > THRESHOLDS.one_run
    )


def may_be_exchanged(model: Evaluation) -> bool:
    """Whether the gap is as large as one that readings in another order would leave."""
    y, weight = model.problem.data.y, model.weight
    gap = squared_gap_and_noise(model.problem, weight, model)[0]
    differences = (
        float(np.sum((weight * (y - y[list(order)])) ** 2))
        for order in orders(model.problem.recording.runs)
    )
    return _leaves_a_gap(model) and gap > THRESHOLDS.exchange_share * min(
        differences, default=np.inf
    )


def may_be_reversed(model: Evaluation) -> bool:
    """Whether the gap is as large as one that readings in reverse order would leave."""
    problem, weight = model.problem, model.weight
    gap = squared_gap_and_noise(problem, weight, model)[0]
    other = problem.with_recording(backwards(problem.recording)).data.y
    difference = float(np.sum((weight * (problem.data.y - other)) ** 2))
    return _leaves_a_gap(model) and gap > THRESHOLDS.backwards_share * difference


def _leaves_a_gap(model: Evaluation) -> bool:
    gap, noise = squared_gap_and_noise(model.problem, model.weight, model)
    return gap > THRESHOLDS.changed_runs_gap**2 * noise


def _explained_of_one(model: Evaluation) -> float:
    """The largest share of a run's errors that one change of it explains, by the other runs.

    The model follows those along its derivatives.
    """
    problem, weight = model.problem, model.weight
    jacobian = model.jacobian.reshape(*weight.shape, -1)
    error = weight * model.error
    own = np.einsum("rti,rtj->rij", jacobian, jacobian)
    pull = np.einsum("rti,rt->ri", jacobian, error)
    columns = [weight[:, None, :] * change_columns(problem, model, kind) for kind in KINDS]
    best = 0.0
    for row in range(weight.shape[0]):
        matrix, gradient = own.sum(axis=0) - own[row], pull.sum(axis=0) - pull[row]
        length = np.sqrt(np.diag(matrix))
        unit = np.where(length > 0, length, np.inf)
        scaled = matrix / np.outer(unit, unit)
        step = np.linalg.lstsq(scaled, -gradient / unit, rcond=THRESHOLDS.changed_runs_rank)[0]
        there = error[row] + jacobian[row] @ (step / unit)
        for column in columns:
            along = column[row, row]
            whole = float(along @ along) * float(there @ there)
            if np.isfinite(whole) and whole > 0:
                best = max(best, float(along @ there) ** 2 / whole)
    return best
