"""A problem with its weights, as a fit poses it: without outliers, or with a robust loss."""

import dataclasses
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, DataError, Recording

from ._options import default_free
from ._thresholds import THRESHOLDS
from ._weights import run_weights
from .assessment._ends import Start
from .assessment._estimates import cut_to_runs
from .data_checks._data_checks import check_usable
from .data_checks._fault import Fault
from .data_checks._outliers import (
    few_outliers,
    find_outliers,
    leave_out,
)
from .data_checks.drives._drive_noise import find_drive_noise
from .data_checks.runs._exchanged_runs import (
    find_copied_readings,
    find_exchanged_runs,
    find_reversed_time,
)
from .data_checks.runs._first_order import may_be_changed, may_be_exchanged, may_be_reversed
from .data_checks.runs._run_changes import find_changed_runs
from .problem._problem import Problem, Solution
from .problem._solution import Evaluation
from .robust._despike import despike
from .robust._loss import AbstractLoss
from .robust._reweighting import Reweighting, search_reweighted


@dataclasses.dataclass(frozen=True, eq=False)
class Posed:
    """A problem with its weights: of the runs, and square roots of those of the samples.

    `recording`: as given; the problem's own may leave readings out. `reweighting`: what a robust
    loss makes of single readings; `None` for squares.
    """

    problem: Problem
    per_run: np.ndarray
    weight: np.ndarray
    recording: Recording
    reweighting: Reweighting | None = None

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
        return cls(problem, per_run, problem.weights(per_run), recording)

    def without_outliers(
        self,
        search: Callable[["Posed"], tuple[Solution, list[Start]]],
        found: tuple[Solution, list[Start]] | None = None,
    ) -> tuple["Posed", tuple[Solution, list[Start]]]:
        """The problem without outliers, and what `search` finds of it.

        Outliers show in what a fit leaves, large ones first: so it is searched again without them.
        `found`: what was found with all readings, if that is known.
        """
        posed, found = self, search(self) if found is None else found
        for _ in range(THRESHOLDS.outlier_rounds):
            outliers = few_outliers(find_outliers(posed.problem, found[0].error))
            if not any(out.any() for out in outliers):
                break
            problem = posed.problem.with_recording(leave_out(posed.problem.recording, outliers))
            if problem.data.use.sum() <= problem.free_count:
                break
            posed = dataclasses.replace(
                posed, problem=problem, weight=problem.weights(self.per_run)
            )
            found = search(posed)
        return posed, found

    def reweighted(
        self,
        name: str,
        loss: AbstractLoss,
        search: Callable[["Posed"], tuple[Solution, list[Start]]],
        options: SolverOptions,
        found: tuple[Solution, list[Start]] | None = None,
    ) -> tuple["Posed", tuple[Solution, list[Start]]]:
        """The problem with the weights that `loss` gives the readings, and the fit under these.

        `found`: what was found with equal weights, if that is known.
        """
        state, solution, starts = search_reweighted(
            self.problem, self.per_run, name, loss,
            lambda weight: search(dataclasses.replace(self, weight=weight)), options, found,
        )  # fmt: skip
        weight = self.problem.weights(self.per_run) * np.sqrt(state.share)
        return dataclasses.replace(self, weight=weight, reweighting=state), (solution, starts)

    def checked_error(self, solution: Evaluation) -> np.ndarray:
        """The residuals to look for faults in."""
        error = solution.error
        return error if self.reweighting is None else despike(error, self.problem.data.use)

    def suspicions(self, model: ECDL, steps: int) -> list[Fault]:
        """As `inconsistencies`, of a `model` that was fitted nearly so.

        Fitted anew, in at most so many `steps`, only where runs may be changed, exchanged or
        reversed.
        """
        problem, weight = self.problem, self.weight
        near = problem.evaluate(problem.start(model), weight)
        found = self._plain_inconsistencies(near)
        searches = (
            (may_be_changed, find_changed_runs),
            (may_be_exchanged, find_exchanged_runs),
            (may_be_reversed, find_reversed_time),
        )

        def refine(problem: Problem, start: np.ndarray, weight: np.ndarray) -> Evaluation:
            return problem.refine(start, weight, steps)

        likely = [] if found else [search for asks, search in searches if asks(near)]
        if likely:
            end = refine(problem, near.start, weight)
            for search in likely:
                found = found or search(problem, weight, end, refine)
        return found

    def _plain_inconsistencies(self, model: Evaluation) -> list[Fault]:
        errors = cut_to_runs(self.problem, self.checked_error(model))
        noisy = find_drive_noise(self.problem.recording, errors)
        return find_copied_readings(self.recording) + noisy

    def inconsistencies(self, solution: Solution, options: SolverOptions) -> list[Fault]:
        """Drives and readings that do not belong together, as one model for all runs shows."""

        def fit(problem: Problem, start: np.ndarray, weight: np.ndarray) -> Evaluation:
            return problem.solve(start, weight, options)

        problem, weight = self.problem, self.weight
        return (
            self._plain_inconsistencies(solution)
            or find_changed_runs(problem, weight, solution, fit)
            or find_exchanged_runs(problem, weight, solution, fit)
            or find_reversed_time(problem, weight, solution, fit)
        )


def _check_size(problem: Problem) -> None:
    samples = int(problem.data.use.sum())
    if samples <= problem.free_count:
        raise DataError(
            f"{samples} usable samples cannot fix {problem.free_count} parameters. Record more, or "
            "fit fewer plays or a lower order."
        )
