"""`fit`: identify the free parameters of a model on all runs of a recording (Eqs. 25 to 27)."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, DataError, Recording, parameters
from rapi_jax.internal import float64, usable

from ._result import FitResult, UntrustedFit
from ._starts import Guesses, search_starts
from ._thresholds import THRESHOLDS
from ._weights import run_weights
from .assessment._claim import curvature, make_claim
from .assessment._convergence import refine
from .assessment._covariance import estimate_uncertainty
from .assessment._cross_validation import KINDS, cross_validate
from .assessment._ends import Start
from .assessment._estimates import cut_to_runs, estimate_parameters, summarise_runs
from .assessment._noise import measure_noise
from .assessment._verdict import judge
from .data_checks._data_checks import check_usable
from .data_checks._drive_noise import find_drive_noise
from .data_checks._fault import Fault
from .data_checks._mode_hops import find_mode_hops
from .data_checks._outliers import (
    few_outliers,
    find_outliers,
    leave_out,
    plain_faults,
    report_outliers,
)
from .data_checks._thinning import thin
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
from .robust._loss import AbstractLoss, loss_of
from .robust._reweighting import Reweighting, search_reweighted

Progress = Callable[[str], None]


def default_free(ecdl: ECDL, recording: Recording) -> Callable[[ECDL], Any]:
    """What a fit frees unless told: the operator, less what these data cannot tell from the rest.

    See the operator's `held`.
    """
    held = ecdl.operator.held(recording)
    names = [p.name for p in parameters(ecdl.operator) if not p.held and p.name not in held]
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
    loss: str = "squares",
    starts: int = 6,
    guess: bool | Sequence[ECDL] | Guesses = True,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = True,
    max_steps: int = 120,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Identify the free parameters of `ecdl` on `recording`.

    **Arguments:**

    - `ecdl`: the model to fit; its values are one of the starts. It counts drives from its own
      origin, which stands unless freed: where drives may be written with an offset of up to four
      times their range, `identify` finds which origin fits, and `fit` does not.
    - `recording`: of more than 400 000 samples it is thinned; the result holds what was fitted.
    - `free`: selects what may move, as in `equinox.tree_at`: `lambda e: e.operator`, or
      `lambda e: (e.operator.lam, e.effects[-1])`. Default: see `default_free`.
    - `weights`: `A_j` of Eq. 26: "hysteresis" (its percentage), "uniform", or one number a run.
    - `loss`: of residuals. "squares", with outliers left out and listed; or, for data that cannot
      be cleaned, "huber" or "student" (heavier tails): every reading counts, by a weight.
    - `starts`: at most so many first guesses; two that end with nearly the same response are
      enough. Starts beside an end found before come on top: see `search_starts`.
    - `guess`: let first guesses from the data be among the starts; or models to use as such,
      or guesses made before.
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

    >>> from fitting import fit
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> result.rmse < 0.025  # GHz: the noise is 0.02
    True
    """
    began = time.perf_counter()
    report = progress or (lambda line: None)
    options = solver_options(max_steps)
    kind = loss_of(loss)
    given, (recording, note) = recording, thin(recording)
    if note is not None:
        report(note)
    posed = Posed.of(ecdl, recording, free, weights, history=history, drift=drift)

    def search(posed: Posed) -> tuple[Solution, list[Start]]:
        report("starts")
        return search_starts(posed.problem, posed.weight, starts, options, guess=guess)

    if kind is None:
        posed, (solution, ends) = posed.without_outliers(search)
    else:
        posed, (solution, ends) = posed.reweighted(loss, kind, search, options)
    result = posed.conclude(solution, ends, hold_out, options, began, report).noting(note, given)
    if throw and not result.verdict.trusted:
        raise UntrustedFit(result)
    return result


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
        robust = self.reweighting
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
        faults = self._faults(solution, options)
        verdict = judge(
            problem, weight, solution, starts, held_out, faults, uncertainty.stderr, noise, claim,
            robust,
        )  # fmt: skip
        return FitResult(
            ecdl=problem.model(solution.values),
            recording=self.recording,
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

    def _faults(self, solution: Solution, options: SolverOptions) -> list[Fault]:
        """What is wrong with the data, the plain first; the search for causes only without it."""
        problem = self.problem
        recording = problem.recording
        errors = cut_to_runs(problem, self._checked_error(solution))
        found = plain_faults(problem) + find_mode_hops(recording, errors)
        if not found:
            found = self.inconsistencies(solution, options)
        if self.reweighting is not None:
            return found  # no reading is left out, so none is named
        left = find_outliers(problem, solution.error)
        return found + report_outliers(self.recording, recording, left)

    def _checked_error(self, solution: Evaluation) -> np.ndarray:
        """The residuals to look for faults in."""
        error = solution.error
        return error if self.reweighting is None else despike(error, self.problem.data.use)

    def suspicions(self, model: ECDL, options: SolverOptions) -> list[Fault]:
        """As `inconsistencies`, of a `model` that was fitted nearly so.

        Fitted anew only where runs may be changed, exchanged or reversed.
        """
        problem, weight = self.problem, self.weight
        near = problem.evaluate(problem.start(model), weight)
        found = self._plain_inconsistencies(near)
        searches = (
            (may_be_changed, find_changed_runs),
            (may_be_exchanged, find_exchanged_runs),
            (may_be_reversed, find_reversed_time),
        )
        likely = [] if found else [search for asks, search in searches if asks(near)]
        if likely:
            end = problem.solve(near.start, weight, options)
            for search in likely:
                found = found or search(problem, weight, end, options)
        return found

    def _plain_inconsistencies(self, model: Evaluation) -> list[Fault]:
        errors = cut_to_runs(self.problem, self._checked_error(model))
        noisy = find_drive_noise(self.problem.recording, errors)
        return find_copied_readings(self.recording) + noisy

    def inconsistencies(self, solution: Solution, options: SolverOptions) -> list[Fault]:
        """Drives and readings that do not belong together, as one model for all runs shows."""
        problem, weight = self.problem, self.weight
        return (
            self._plain_inconsistencies(solution)
            or find_changed_runs(problem, weight, solution, options)
            or find_exchanged_runs(problem, weight, solution, options)
            or find_reversed_time(problem, weight, solution, options)
        )


def _check_size(problem: Problem) -> None:
    samples = int(problem.data.use.sum())
    if samples <= problem.free_count:
        raise DataError(
            f"{samples} usable samples cannot fix {problem.free_count} parameters. Record more, or "
            "fit fewer plays or a lower order."
        )
