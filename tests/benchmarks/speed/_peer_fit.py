"""The peer's fit: SciPy's trust-region least squares on the Numba residual."""

from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ._peer_jacobian import jacobian
from ._peer_model import residuals
from ._runs import Runs, Shape


class PeerFit(NamedTuple):
    """The end of a fit: half the sum of squares, and standard errors for white residuals."""

    values: np.ndarray
    cost: float
    stderr: np.ndarray
    steps: int
    evaluations: int


def cost_at(values: np.ndarray, shape: Shape, runs: Runs) -> float:
    """Half the sum of squared residuals."""
    error = residuals(values, shape, runs)
    return 0.5 * float(error @ error)


def peer_fit(start: np.ndarray, shape: Shape, runs: Runs, *, analytic: bool) -> PeerFit:
    """Fit from `start`; with the closed Jacobian, or by finite differences.

    With a `lam` for each play these are first tied to one, as ours does: without that SciPy ends
    2 % higher.
    """
    solve = partial(_solve, runs=runs, derivative=jacobian if analytic else "2-point")
    steps = evaluations = 0
    if shape.lams > 1:
        lam = slice(2, 2 + shape.lams)
        tied = np.concatenate([start[:2], [start[lam].mean()], start[lam.stop :]])
        first = solve(tied, shape._replace(lams=1))
        steps, evaluations = int(first.njev), int(first.nfev)
        start = np.concatenate([first.x[:2], np.full(shape.lams, first.x[2]), first.x[3:]])
    found = solve(start, shape)
    variance = 2.0 * found.cost / (found.fun.size - start.size)
    factor = np.linalg.qr(found.jac, mode="r")
    stderr = np.sqrt(variance * np.sum(np.linalg.pinv(factor) ** 2, axis=1))
    steps, evaluations = steps + int(found.njev), evaluations + int(found.nfev)
    return PeerFit(found.x, float(found.cost), stderr, steps, evaluations)


def _solve(start: np.ndarray, shape: Shape, *, runs: Runs, derivative: Any) -> Any:
    return least_squares(
        residuals, start, derivative, method="trf", x_scale="jac", args=(shape, runs)
    )
