"""`fit`: identify the free parameters of a model on all runs of a recording (Eqs. 25 to 27)."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, DataError, Recording, parameters
from rapi_jax.internal import float64

from ._problem import Problem, Solution
from ._result import FitResult, UntrustedFit
from ._starts import Start, search_starts
from ._thresholds import THRESHOLDS
from ._weights import run_weights
from .assessment._convergence import refine
from .assessment._covariance import estimate_uncertainty
from .assessment._cross_validation import KINDS, cross_validate
from .assessment._estimates import cut_to_runs, estimate_parameters, summarise_runs
from .assessment._verdict import judge
from .data_checks._data_checks import check_usable, find_faults, find_mode_hops

Progress = Callable[[str], None]


def default_free(ecdl: ECDL, recording: Recording) -> Callable[[ECDL], Any]:
    """What a fit frees unless told: the operator, less what these data cannot tell from the rest.

    See the operator's `held`.
    """
    held = ecdl.operator.held(recording)
    names = [p.name for p in parameters(ecdl.operator) if p.name not in held]
    return lambda e: tuple(getattr(e.operator, name) for name in names)


def solver_options(max_steps: int) -> SolverOptions:
    """How far fits of models are driven."""
    return SolverOptions(
        THRESHOLDS.solver_tolerance, THRESHOLDS.solver_slope, max_steps, THRESHOLDS.solver_promise
    )


@float64
def fit(
    ecdl: ECDL,
    recording: Recording,
    *,
    free: Callable[[ECDL], Any] | None = None,
    weights: str | Sequence[float] = "hysteresis",
    starts: int = 6,
    guess: bool | Sequence[ECDL] = True,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = True,
    max_steps: int = 120,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Identify the free parameters of `ecdl` on `recording`.

    **Arguments:**

    - `ecdl`: the model to fit; its values are one of the starts.
    - `free`: selects what may move, as in `equinox.tree_at`: `lambda e: e.operator`, or
      `lambda e: (e.operator.lam, e.effects[-1])`. Default: see `default_free`.
    - `weights`: `A_j` of Eq. 26: "hysteresis" (its percentage), "uniform", or one number a run.
    - `starts`: at most so many starts; two that agree on the best end are enough.
    - `guess`: let first guesses from the data be among the starts; or models to use as such.
    - `history`: free the plays' initial values in runs that do not repeat.
    - `drift`: let the origin creep with the logarithm of session time, as piezos do. By default
      where some run holds six periods or more; the model itself keeps no drift.
    - `hold_out`: also refit without the last third, and without each rate and amplitude; or some
      of "last third", "rate" and "amplitude".
    - `max_steps`: the limit of solver steps in each fit, looked at every forty.
    - `throw`: raise `UntrustedFit` where the verdict is not to be trusted.
    - `progress`: called with a line before each step.

    **Returns** a `FitResult`. Raises `DataError` where the recording holds fewer usable samples
    than there are parameters.
    """
    began = time.perf_counter()
    report = progress or (lambda line: None)
    options = solver_options(max_steps)
    posed = Posed.of(ecdl, recording, free, weights, history=history, drift=drift)
    report("starts")
    solution, ends = search_starts(posed.problem, posed.weight, starts, options, guess=guess)
    result = posed.conclude(solution, ends, hold_out, options, began, report)
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result


@dataclasses.dataclass(frozen=True, eq=False)
class Posed:
    """A problem with its weights: of the runs, and square roots of those of the samples."""

    problem: Problem
    per_run: np.ndarray
    weight: np.ndarray

    @classmethod
    def of(
        cls,
        ecdl: ECDL,
        recording: Recording,
        free: Callable[[ECDL], Any] | None,
        weights: str | Sequence[float],
        *,
        history: bool,
        drift: bool | None,
    ) -> "Posed":
        """The problem of a fit with these arguments; `DataError` where the data are too few."""
        check_usable(recording)
        chosen = default_free(ecdl, recording) if free is None else free
        problem = Problem.of(ecdl, recording, chosen, history=history, drift=drift)
        _check_size(problem)
        per_run = run_weights(recording, weights)
        return cls(problem, per_run, problem.weights(per_run))

    def conclude(
        self,
        solution: Solution,
        starts: list[Start],
        hold_out: bool | tuple[str, ...],
        options: SolverOptions,
        began: float,
        report: Progress,
    ) -> FitResult:
        """The result, with errors and verdict; `solution` is the best of the ends of `starts`."""
        problem, per_run, weight = self.problem, self.per_run, self.weight
        recording = problem.recording
        solution = refine(problem, weight, solution, options)
        report("standard errors")
        uncertainty = estimate_uncertainty(problem, solution, per_run)
        held_out = []
        if hold_out:
            report("held-out data")
            kinds = KINDS if hold_out is True else hold_out
            held_out = cross_validate(problem, per_run, solution, kinds, options=options)
        errors = cut_to_runs(problem, solution.error)
        faults = find_faults(recording) + find_mode_hops(recording, errors)
        verdict = judge(problem, weight, solution, starts, held_out, faults, uncertainty.stderr)
        return FitResult(
            ecdl=problem.model(solution.values),
            recording=recording,
            verdict=verdict,
            parameters=estimate_parameters(problem, solution, uncertainty, verdict),
            runs=summarise_runs(problem, solution, uncertainty, per_run),
            rmse=float(np.sqrt(np.mean(solution.error[problem.data.use] ** 2))),
            held_out=tuple(held_out),
            starts=tuple(starts),
            faults=tuple(faults),
            names=tuple(problem.names[i] for i in uncertainty.fitted),
            correlation=uncertainty.fitted_correlation,
            effective=uncertainty.effective,
            predicted=tuple(cut_to_runs(problem, solution.error + problem.data.y)),
            used=tuple(cut_to_runs(problem, problem.data.use)),
            seconds=time.perf_counter() - began,
        )


def _check_size(problem: Problem) -> None:
    samples = int(problem.data.use.sum())
    if samples <= problem.free_count:
        raise DataError(
            f"{samples} usable samples cannot fix {problem.free_count} parameters. Record more, or "
            "fit fewer plays or a lower order."
        )
