"""Small nonlinear least-squares problems of the readout, by Levenberg and Marquardt's method.

One reading solves thousands of problems of 4 to 50 parameters on hundreds of samples, each stopped
early. SciPy's MINPACK takes 1.3 to 1.7 times as long on them (it factorises the Jacobian where
normal equations suffice at these tolerances) and knows no penalty; optimistix would compile for
every number of samples.
"""

import dataclasses
from collections.abc import Callable

import numpy as np
from jaxtyping import Float

Model = Callable[
    [np.ndarray], tuple[Float[np.ndarray, " samples"], Float[np.ndarray, "samples parameters"]]
]


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """Parameters, residual (data less model) and Jacobian of the model there.

    `cost`: sum of squared residuals and penalty.
    """

    parameters: Float[np.ndarray, " parameters"]
    residual: Float[np.ndarray, " samples"]
    jacobian: Float[np.ndarray, "samples parameters"]
    cost: float


def levenberg_marquardt(
    model: Model,
    data: Float[np.ndarray, " samples"],
    start: Float[np.ndarray, " parameters"],
    *,
    steps: int,
    tolerance: float,
    penalty: Float[np.ndarray, "parameters parameters"] | None = None,
    project: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None,
) -> Fit:
    """Least squares of `data - model(p)`, and of `p' penalty p`, from `start`.

    **Arguments:**

    - `model`: its values and their derivatives by each parameter.
    - `steps`: the most steps tried; `tolerance`: the relative fall of the cost that ends the fit.
    - `project`: takes a trial and the parameters it was made from into the allowed region.
    """
    p = np.array(start, dtype=float)
    if penalty is None:
        penalty = np.zeros((p.size, p.size))
    value, jacobian = model(p)
    residual = data - value
    cost = float(residual @ residual + p @ penalty @ p)
    damping = _FIRST_DAMPING
    for _ in range(steps):
        normal = jacobian.T @ jacobian + penalty
        gradient = jacobian.T @ residual - penalty @ p
        try:
            step = np.linalg.solve(normal + damping * np.diag(np.diag(normal) + _TINY), gradient)
        except np.linalg.LinAlgError:
            break
        trial = p + step if project is None else project(p + step, p)
        value, trial_jacobian = model(trial)
        trial_residual = data - value
        trial_cost = float(trial_residual @ trial_residual + trial @ penalty @ trial)
        if trial_cost < cost:
            converged = cost - trial_cost < tolerance * cost
            p, jacobian, residual, cost = trial, trial_jacobian, trial_residual, trial_cost
            damping = max(damping / _LESS, _LEAST_DAMPING)
            if converged:
                break
        else:
            damping *= _MORE
            if damping > _MOST_DAMPING:
                break
    return Fit(p, residual, jacobian, cost)


# Of the usual size (Marquardt 1963: factors of 2 to 10); they change the number of steps alone.
_FIRST_DAMPING, _LEAST_DAMPING, _MOST_DAMPING = 1e-3, 1e-9, 1e8
_LESS, _MORE = 5.0, 6.0
_TINY = 1e-12  # keeps a parameter without influence where it is
