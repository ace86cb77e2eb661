"""Our fits: the solver alone, and the complete `fit`. The private names in use are all here."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting import FitResult, fit
from fitting.identification._fit_many import solve_many
from fitting.identification._options import default_free, solver_options
from fitting.identification._posed import Posed
from fitting.identification._starts import tied_groups
from fitting.identification._weights import run_weights
from fitting.identification.problem._problem import Problem, Solution
from rapi_jax import ECDL, Drive, Recording, predict
from rapi_jax.internal import compiled_respond, float64, to_batch

from ._cases import Case

OPTIONS = solver_options(1000)


@float64
def bare(given: Case) -> Solution:
    """Least squares alone, the preparation of the data included.

    With a `lam` for each play these are first tied to one, as `fit` does.
    """
    problem = Problem.of(given.start, given.recording, default_free(given.start, given.recording))
    weight = problem.weights(run_weights(given.recording, "hysteresis"))
    begin = problem.start(given.start)
    groups = tied_groups(given.start.operator, problem)
    if groups is not None:
        begin = problem.solve(begin, weight, OPTIONS, ties=groups).start
    found = problem.solve(begin, weight, OPTIONS)
    assert np.isfinite(found.values).all()  # solved for when asked for: the linear part, too
    return found


@float64
def bare_many(cases: Sequence[Case], lanes: int) -> list[Solution]:
    """The same for many recordings, up to `lanes` of them solved by one program."""
    posed = [
        Posed.of(one.start, one.recording, None, "hysteresis", history=True, drift=None)
        for one in cases
    ]
    begins = [one.problem.start(case.start) for one, case in zip(posed, cases, strict=True)]
    found = solve_many(posed, begins, OPTIONS, lanes)
    assert all(np.isfinite(end.values).all() for end in found)
    return found


SETTINGS: dict[str, Any] = {
    "starts": 1,
    "guess": False,
    "hold_out": False,
    "throw": False,
    "max_steps": OPTIONS.max_steps,
}


def fitted(given: Case) -> FitResult:
    """The complete `fit` from one start, with standard errors and verdict."""
    return fit(given.start, given.recording, **SETTINGS)


def start_cost(given: Case) -> float:
    """The cost of the start by our forward model."""
    total = 0.0
    for run, weight in zip(given.recording.runs, given.runs.weight, strict=True):
        error = weight * (np.asarray(predict(given.start, run.drive)) - run.response)
        total += 0.5 * float(error @ error)
    return total


@float64
def forward_of(ecdl: ECDL, drives: Sequence[Drive]) -> Callable[[], Any]:
    """A call of the compiled forward model on data that are on the device already."""
    recording = Recording.of(drives, [np.zeros(drive.size) for drive in drives])
    prepared = to_batch(recording).device()
    return float64(lambda: compiled_respond(ecdl, prepared))
