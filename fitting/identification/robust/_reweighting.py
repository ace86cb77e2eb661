"""Iteratively reweighted least squares (P. W. Holland and R. E. Welsch, Commun. Stat. A6, 1977).

Each round fits with the weights that the residuals of the last one ask for, in units of a scale
that is taken from them again: the median of their sizes, run by run.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Bool, Float

from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.assessment._ends import Start
from fitting.identification.problem._problem import Problem, Solution
from fitting.solver._least_squares import SolverOptions

from ._loss import AbstractLoss

Search = Callable[[Float[np.ndarray, "runs time"]], tuple[Solution, list[Start]]]


@dataclasses.dataclass(frozen=True, eq=False)
class Reweighting:
    """What a robust loss makes of the residuals of a fit.

    - `share`: the weight of each reading from 0 to 1, beside that of its run.
    - `slope`: of each run, how much of a small change of the model the loss answers on average.
    - `normal_rms`: of weighted residuals under normal noise of this scale.
    - `change`: by how much the last round moved the model, rms in units of the scale.
    - `rounds`: how many there were.
    """

    name: str
    share: Float[np.ndarray, "runs time"]
    slope: Float[np.ndarray, " runs"]
    normal_rms: float
    change: float
    rounds: int

    @classmethod
    def of(
        cls,
        name: str,
        loss: AbstractLoss,
        error: Float[np.ndarray, "runs time"],
        use: Bool[np.ndarray, "runs time"],
        change: float = np.inf,
        rounds: int = 0,
    ) -> "Reweighting":
        """That of the residuals `error`, where they are used."""
        z = error / scale_of(error, use)[:, None]
        slopes = loss.slope(z)
        mean = np.array([slopes[row, used].mean() for row, used in enumerate(use)])
        return cls(name, loss.weight(z), mean, loss.normal_rms, change, rounds)

    @property
    def converged(self) -> bool:
        """Whether the last round moved the model by next to nothing."""
        return self.change <= THRESHOLDS.reweighting_change

    def judged(self, error: Float[np.ndarray, "runs time"]) -> Float[np.ndarray, "runs time"]:
        """Errors to judge a fit by: weighted, with the rms unchanged where noise is normal."""
        return error * self.share / self.normal_rms

    def reasons(self) -> list[str]:
        """What speaks against the fit."""
        if self.converged:
            return []
        return [
            f"not converged: after {self.rounds} rounds of weights for loss {self.name!r} the "
            f"model still moves by {self.change:.2g} of the noise. Another loss, or cleaner data."
        ]

    def notes(self, use: Bool[np.ndarray, "runs time"]) -> list[str]:
        """What to know about the fit."""
        few = int((self.share[use] < 0.5).sum())
        return [
            f"loss {self.name!r}: no reading is left out; {few} of {int(use.sum())} count less "
            "than half. Errors that judge the fit are weighted likewise."
        ]


def scale_of(
    error: Float[np.ndarray, "runs time"], use: Bool[np.ndarray, "runs time"]
) -> Float[np.ndarray, " runs"]:
    """The median size of each run's residuals, as a standard deviation if they were normal.

    Never less than rounding of the residuals, which an exact fit leaves.
    """
    usual = [1.4826 * float(np.median(np.abs(error[row, used]))) for row, used in enumerate(use)]
    return np.maximum(usual, THRESHOLDS.reweighting_least * max(max(usual), 1e-300))


def search_reweighted(
    problem: Problem,
    run_weights: Float[np.ndarray, " runs"],
    name: str,
    loss: AbstractLoss,
    search: Search,
    options: SolverOptions,
    found: tuple[Solution, list[Start]] | None = None,
) -> tuple[Reweighting, Solution, list[Start]]:
    """The M-estimate: its weights, the fit with them, and what became of the starts with them.

    `search`: a fit from several starts under the weights it is given. It is asked for one at equal
    weights (`found`, if that is known) and again at the weights to which that leads, so that the
    starts say whether these have one optimum.
    """
    plain = problem.weights(run_weights)
    solution, _ = search(plain) if found is None else found
    state, solution = _reweight(problem, plain, name, loss, solution, options)
    end, starts = search(plain * np.sqrt(state.share))
    if end.cost < solution.cost * (1.0 - THRESHOLDS.reweighting_gain):
        state, solution = _reweight(problem, plain, name, loss, end, options)
    return state, solution, starts


def _reweight(
    problem: Problem,
    plain: Float[np.ndarray, "runs time"],
    name: str,
    loss: AbstractLoss,
    solution: Solution,
    options: SolverOptions,
) -> tuple[Reweighting, Solution]:
    """Rounds of weights and fits from `solution` until the model comes to rest."""
    use = problem.data.use
    state = Reweighting.of(name, loss, solution.error, use)
    for rounds in range(1, THRESHOLDS.reweighting_rounds + 1):
        error = solution.error
        state = Reweighting.of(name, loss, error, use)
        solution = problem.solve(solution.start, plain * np.sqrt(state.share), options)
        moved = (solution.error - error) / scale_of(error, use)[:, None]
        change = float(np.sqrt(np.mean(moved[use] ** 2)))
        state = dataclasses.replace(state, change=change, rounds=rounds)
        if state.converged:
            break
    return state, solution
