"""The end of a fit: standard errors, held-out data, faults, claim, verdict, and the result."""

import time

import numpy as np

from fitting.solver._least_squares import SolverOptions
from rapi_jax.internal import usable

from ._options import Progress
from ._posed import Posed
from ._result import FitResult
from .assessment._claim import curvature, make_claim
from .assessment._convergence import refine
from .assessment._covariance import estimate_uncertainty
from .assessment._cross_validation import KINDS, cross_validate
from .assessment._ends import Start
from .assessment._estimates import cut_to_runs, estimate_parameters, summarise_runs
from .assessment._noise import measure_noise
from .assessment._verdict import judge
from .data_checks._fault import Fault
from .data_checks._mode_hops import find_mode_hops
from .data_checks._outliers import (
    find_outliers,
    plain_faults,
    report_outliers,
)
from .problem._problem import Solution


def conclude(
    posed: Posed,
    solution: Solution,
    starts: list[Start],
    hold_out: bool | tuple[str, ...],
    options: SolverOptions,
    began: float,
    report: Progress,
) -> FitResult:
    """The result, with errors and verdict; `solution` is the best of the ends of `starts`."""
    problem, per_run, weight = posed.problem, posed.per_run, posed.weight
    recording = problem.recording
    solution = refine(problem, weight, solution, options)
    report("standard errors")
    robust = posed.reweighting
    uncertainty = estimate_uncertainty(problem, solution, per_run, robust)
    held_out = []
    if hold_out:
        report("held-out data")
        kinds = KINDS if hold_out is True else hold_out
        held_out = cross_validate(
            problem, per_run, solution, kinds, options=options, reweighting=robust
        )
    judged = solution.error if robust is None else robust.judged(solution.error)
    noise = measure_noise(problem, judged)
    curved = curvature(recording, [usable(r, recording.response_lag_s) for r in recording.runs])
    claim = make_claim(recording, held_out, noise, curved)
    report("faults")
    faults = _find_faults(posed, solution, options)
    verdict = judge(
        problem, weight, solution, starts, held_out, faults, uncertainty.stderr, noise, claim,
        robust,
    )  # fmt: skip
    return FitResult(
        ecdl=problem.model(solution.values),
        recording=posed.recording,
        verdict=verdict,
        claim=claim,
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
        loss="squares" if robust is None else robust.name,
    )


def _find_faults(posed: Posed, solution: Solution, options: SolverOptions) -> list[Fault]:
    """What is wrong with the data, the plain first; the search for causes only without it."""
    problem = posed.problem
    recording = problem.recording
    errors = cut_to_runs(problem, posed.checked_error(solution))
    found = plain_faults(problem) + find_mode_hops(recording, errors)
    if not found:
        found = posed.inconsistencies(solution, options)
    if posed.reweighting is not None:
        return found  # no reading is left out, so none is named
    left = find_outliers(problem, solution.error)
    return found + report_outliers(posed.recording, recording, left)
