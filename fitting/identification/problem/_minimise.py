"""The minimum of a problem's weighted squares, over contact intervals or over all samples."""

import dataclasses
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from fitting.identification._parameter_vector import as_device
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.intervals._sums import IntervalSums
from fitting.solver._least_squares import SolverOptions, least_squares
from fitting.solver._optimum import LeastSquares

from ._bounds import bounds_of
from ._run_residual import Data

if TYPE_CHECKING:
    from ._problem import Problem


def minimise(
    problem: "Problem",
    own: np.ndarray,
    weight: np.ndarray,
    move: np.ndarray,
    ties: np.ndarray | None,
    options: SolverOptions,
) -> LeastSquares:
    """Over contact intervals where these are known, and have digits enough for the end."""
    fit = partial(least_squares, free=move, ties=ties, options=stop_by_chi_square(options, weight))
    sums = IntervalSums.of(problem, own)
    if sums is not None:
        data = sums.data(weight)
        found = fit(problem.interval_residual, own, data, bounds=bounds_of(problem, own))
        if sums.resolves(found, data):
            return found
        if np.isfinite(found.cost):
            own = np.where(move, found.values, own)
    basis = problem.linear_part(weight).basis
    data = Data(problem.drives, *(as_device(a) for a in (problem.data.y, weight, basis)))
    return fit(problem.residual(), own, data, bounds=bounds_of(problem, own))


def stop_by_chi_square(options: SolverOptions, weight: np.ndarray) -> SolverOptions:
    """`options`, with an end where a whole step promises next to nothing of chi-square."""
    if not options.promise:
        return options
    share = THRESHOLDS.solver_chi_square / max(int((weight > 0).sum()), 1)
    return dataclasses.replace(options, whole_promise=share)
