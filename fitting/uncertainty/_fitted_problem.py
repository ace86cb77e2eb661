"""The fitting problem behind a result, posed again at its end."""

import dataclasses
from typing import Any

import numpy as np

from fitting.identification._posed import Posed
from fitting.identification._result import FitResult
from fitting.identification._thresholds import THRESHOLDS as IDENTIFICATION
from fitting.identification.assessment._covariance import Uncertainty, estimate_uncertainty
from fitting.identification.problem._problem import Problem, Solution
from fitting.solver._identifiability import pseudo_gram
from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, ModelError, Recording, Run
from rapi_jax.internal import follow

# Every fit ends where a step no longer moves it: costs are compared here, not judged.
OPTIONS = SolverOptions(IDENTIFICATION.solver_tolerance, IDENTIFICATION.solver_slope, 120)


@dataclasses.dataclass(frozen=True, eq=False)
class FittedProblem:
    """A problem with its weights, the end of its fit, and the covariance there.

    `uncertainty` is of the whole vector, as `problem.names`; `plain` is `(J'WJ)^-1` of it, which
    the cost's curvature is the inverse of.
    """

    problem: Problem
    weight: np.ndarray
    solution: Solution
    uncertainty: Uncertainty
    plain: np.ndarray

    @classmethod
    def of(cls, result: FitResult) -> "FittedProblem":
        """That of `result`; a short fit from its end gives what the result does not hold.

        Raises `ModelError` for a fit with a robust loss, which is not that of a likelihood here.
        """
        if result.loss != "squares":
            raise ModelError(
                f"a fit with the loss {result.loss!r} has no likelihood to profile or to sample. "
                'Fit with `loss="squares"`, which leaves outliers out, or use the standard errors.'
            )
        per_run = np.array([run.weight for run in result.runs])
        posed = Posed.of(
            result.ecdl,
            _as_used(result),
            _freed(result),
            list(per_run),
            history=any(name.startswith("initial_") for name in result.names),
            drift="drift" in result.names,
        )
        problem, weight = posed.problem, posed.weight
        solution = problem.solve(problem.start(result.ecdl), weight, OPTIONS)
        uncertainty = estimate_uncertainty(problem, solution, per_run)
        plain, _ = pseudo_gram(solution.jacobian)
        return cls(problem, weight, solution, uncertainty, plain)

    def index(self, name: str) -> int:
        """The place of a fitted parameter; `ModelError` where there is none of that name."""
        fitted = [self.problem.names[i] for i in self.uncertainty.fitted]
        if name not in fitted:
            raise ModelError(f"no fitted parameter {name!r}; there are {', '.join(fitted)}.")
        return self.problem.names.index(name)


def _as_used(result: FitResult) -> Recording:
    """The recording without the readings that the fit left out."""
    runs = []
    for run, used in zip(result.recording.runs, result.used, strict=True):
        runs.append(Run(run.drive, np.where(used, run.response, np.nan), run.name))
    return dataclasses.replace(result.recording, runs=tuple(runs))


def _freed(result: FitResult) -> Any:
    """The selector of what the fit moved."""
    from rapi_jax import parameters

    parts = parameters(result.ecdl)
    held = [estimate.held for estimate in result.parameters]
    ends = np.cumsum([part.size for part in parts])
    free = [part for part, end in zip(parts, ends, strict=True) if not held[end - 1]]

    def select(ecdl: ECDL) -> tuple[Any, ...]:
        return tuple(follow(ecdl, part.path) for part in free)

    return select
