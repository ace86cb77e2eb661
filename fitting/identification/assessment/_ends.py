"""Where the starts of a fit ended, beside the end of lowest cost."""

import dataclasses
from collections import Counter
from collections.abc import Sequence
from typing import Literal

import numpy as np

from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.problem._problem import Problem, Solution

End = Literal["lowest cost", "same cost", "nearly the same response", "another optimum"]


@dataclasses.dataclass(frozen=True)
class Start:
    """One start and its end, beside the end of lowest cost.

    - `origin`: where it came from.
    - `agrees`: its response is nearly that of the best end, whatever its cost (see `agree`).
    - `end`: "lowest cost"; "same cost", where it agrees and its cost is within 0.2 % of the lowest
      (`same_cost`); "nearly the same response", where it agrees and its cost is higher; "another
      optimum", where it does not agree.
    - `excess`: its cost less the lowest, as a share of the lowest.
    - `nearby`: begun beside an end found before, not from a first guess. The limit on starts does
      not count these.
    """

    origin: str
    steps: int
    cost: float
    converged: bool
    agrees: bool
    trace: tuple[tuple[int, float], ...]
    end: End = "lowest cost"
    excess: float = 0.0
    nearby: bool = False

    def describe(self) -> str:
        """Where it ended, in words, with what its cost is above the lowest.

        >>> from fitting.identification.assessment._ends import Start
        >>> Start("guess 2", 9, 1.14, True, True, (), "nearly the same response", 0.14).describe()
        'nearly the same response, cost 14 % higher'
        """
        if self.end == "lowest cost":
            return self.end
        if self.end == "same cost":
            return "same cost and response"
        if self.excess <= THRESHOLDS.same_cost:
            return f"{self.end}, same cost"
        if self.excess < 1.0:
            return f"{self.end}, cost {100.0 * self.excess:.2g} % higher"
        return f"{self.end}, cost {1.0 + self.excess:.3g} times as high"


def correlation(rows: np.ndarray) -> float:
    """Correlation of neighbouring residuals, 0 where negative; rows are runs."""
    power = float(np.sum(rows[:, :-1] ** 2))
    return max(float(np.sum(rows[:, 1:] * rows[:, :-1])) / power, 0.0) if power > 0 else 0.0


def agree(problem: Problem, weight: np.ndarray, one: Solution, other: Solution) -> bool:
    """Whether two ends have nearly the same response where they were fitted.

    Their costs may differ: by about 1 % where residuals are white, and by about 12 % where
    neighbours are wholly correlated: the square of the share by which the responses may differ.
    """
    difference = np.linalg.norm(weight * (one.error - other.error))
    residual = np.sqrt(2.0 * min(one.cost, other.cost))
    share = THRESHOLDS.agreement + THRESHOLDS.agreement_misfit * correlation(
        weight * min(one, other, key=_cost).error
    )
    return bool(difference <= max(share * residual, _exact(problem, weight)))


def _cost(end: Solution) -> float:
    return end.cost


def _exact(problem: Problem, weight: np.ndarray) -> float:
    """Norm of a weighted difference that is rounding beside the response."""
    centred = problem.data.y - problem.data.y[weight > 0].mean()
    return float(THRESHOLDS.agreement_exact * np.linalg.norm(weight * centred))


def rank_ends(
    problem: Problem, weight: np.ndarray, ends: list[tuple[str, Solution]], nearby: int = 0
) -> tuple[Solution, list[Start]]:
    """The best of named ends, and what became of each start.

    `nearby`: so many of the ends, the last ones, were begun beside an end found before.
    """
    best = min((end for _, end in ends), key=_cost)
    same = max(THRESHOLDS.same_cost * best.cost, 0.5 * _exact(problem, weight) ** 2)
    starts = []
    for place, (origin, end) in enumerate(ends):
        agrees, above = agree(problem, weight, best, end), end.cost - best.cost
        kind: End = "another optimum"
        if end is best or above == 0.0 and agrees:
            kind = "lowest cost"
        elif agrees and above <= same:
            kind = "same cost"
        elif agrees:
            kind = "nearly the same response"
        starts.append(
            Start(
                origin,
                end.solver.steps,
                end.cost,
                end.solver.converged,
                agrees,
                end.solver.trace,
                kind,
                above / best.cost if best.cost > 0 else 0.0,
                place >= len(ends) - nearby,
            )
        )
    return best, starts


def settled(problem: Problem, weight: np.ndarray, ends: list[tuple[str, Solution]]) -> bool:
    """Whether enough ends agree with the best."""
    best = min((end for _, end in ends), key=_cost)
    agreeing = sum(agree(problem, weight, best, end) for _, end in ends)
    return agreeing >= THRESHOLDS.agreeing_starts


def describe_starts(starts: Sequence[Start]) -> str:
    """How many starts there were, of which kind, and what their ends have in common."""
    first = sum(not start.nearby for start in starts)
    text = f"{first} from first guesses"
    if first < len(starts):
        text += f", {len(starts) - first} from values beside an end found before"
    ends = Counter(start.end for start in starts)
    same = ends["lowest cost"] + ends["same cost"]
    text += (
        f". {same} of {len(starts)} reached the lowest cost, to {100 * THRESHOLDS.same_cost:g} %"
    )
    if near := ends["nearly the same response"]:
        verb = "responds" if near == 1 else "respond"
        text += f"; {near} {verb} nearly as it does at a higher cost"
    if other := ends["another optimum"]:
        text += f"; {other} ended in another optimum"
    return f"{text}."
