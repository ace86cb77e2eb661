"""A few Gauss-Newton steps on the host, where a fit's compiled iteration would not pay.

That iteration takes seconds to compile for each shape of recording; here nothing is compiled but
the model's derivatives.
"""

from typing import TYPE_CHECKING

import numpy as np

from fitting.identification._thresholds import THRESHOLDS
from fitting.solver._damped_gauss_newton import (
    Damping,
    Linearisation,
    StoppingRule,
    minimise_damped,
)

from ._bounds import bounds_of
from ._solution import Evaluation

if TYPE_CHECKING:
    from ._problem import Problem

# As in a refit of a diagnosis, see its thresholds, with fewer attempts.
_DAMPING = Damping(
    initial=1e-4, decrease=8.0, increase=12.0, smallest=1e-9, largest=1e4, attempts=6,
    shares=(0.3, 0.1),
)  # fmt: skip


@np.errstate(over="ignore", invalid="ignore")  # a step too far is no warning
def refine(problem: "Problem", start: np.ndarray, weight: np.ndarray, max_steps: int) -> Evaluation:
    """The problem after at most `max_steps` damped steps from the vector `start`.

    Ends where steps gain next to nothing: right to that share of the weighted sum of squares, not
    to rounding as `Problem.solve` is. What is linear is projected out (Kaufman, BIT 15, 49).
    """
    own, move = problem.own_vector(start)
    bounds = bounds_of(problem, own).holding(move)
    low, high, coupling = (np.asarray(a) for a in (bounds.low, bounds.high, bounds.coupling))
    n, extra = problem.vector.size, problem.nuisances
    places = np.r_[0:n, n + extra : own.size + extra]
    basis = problem.linear_part(weight).basis

    def at(bounded: np.ndarray) -> Evaluation:
        return Evaluation(problem, coupling @ np.clip(bounded, low, high), move, weight)

    def linearise(now: Evaluation, _: float) -> Linearisation:
        columns = (now.jacobian[:, places] * move) @ coupling[:, move]
        columns -= basis @ (basis.T @ columns)
        gradient = columns.T @ (weight * now.error).ravel()
        here, share = bounds.bounded(now.own)[move], THRESHOLDS.refined_to_bound
        room = (
            share * np.minimum(low[move] - here, 0.0),
            share * np.maximum(high[move] - here, 0.0),
        )
        return Linearisation.of(columns.T @ columns, gradient, room)

    def moved(now: Evaluation, step: np.ndarray) -> Evaluation:
        bounded = bounds.bounded(now.own)
        bounded[move] += step
        return at(bounded)

    small = THRESHOLDS.refined_gain
    return minimise_damped(
        at(bounds.bounded(own)),
        cost=lambda now: now.squares,
        linearise=linearise,
        move=moved,
        damping=_DAMPING,
        stop=StoppingRule(
            negligible=lambda gain, cost: gain <= 0.0,
            slow=lambda gain, cost: gain < small * cost,
        ),
        max_steps=max_steps,
    )
