r"""Profile likelihood of single parameters, calibrated for correlated residuals.

With $S_p(\theta)$ the least weighted sum of squares among all fits that hold one parameter at
$\theta$, $S_p(\theta) - S_p(\hat\theta)$ is not a chi-square: residuals are correlated, and the
weights of runs are not their precisions. Its law near the optimum is that of
$\lambda\chi^2_1$, $\lambda = V/g$, with the variance $V$ of the estimate (the sandwich) and
$g = [(J'WJ)^{-1}]$, the reciprocal curvature of $S_p$ (J. T. Kent, Biometrika 69, 19, 1982). So the
ratio is divided by $\lambda$, which gives it the sandwich's curvature at the optimum and keeps its
shape elsewhere (R. E. Chandler and S. Bate, Biometrika 94, 167, 2007; L. Pace, A. Salvan and
N. Sartori, Statistica Sinica 21, 129, 2011). The noise scale is held at what the fit found.
"""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting.identification._result import FitResult
from fitting.identification.problem._bounds import moving_bounds, project_into_bounds
from fitting.identification.problem._problem import Problem
from rapi_jax import ModelError
from rapi_jax.internal import float64, takes

from ._fitted_problem import OPTIONS, FittedProblem
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class ProfileInterval:
    """The values of a parameter that the data do not speak against at `level`.

    - `value`: at the optimum. `low`, `high`: the ends; infinite where the likelihood stays as high
      up to 64 standard errors away (`open_low`, `open_high`), the bound where that comes first.
    - `at_bound`: whether one of the ends is a bound. `calibration`: by what the sum of squares was
      divided. `evaluations`: fits that were made. `remark`: why an end is open, else empty.

    >>> from fitting import ProfileInterval
    >>> zeta = ProfileInterval("zeta", 0.0067, 0.0065, 0.0069, 0.95, "V/Hz", False, 1.0, 24)
    >>> zeta.low < zeta.value < zeta.high  # V/Hz
    True
    """

    name: str
    value: float
    low: float
    high: float
    level: float
    unit: str
    at_bound: bool
    calibration: float
    evaluations: int
    remark: str = ""

    @property
    def open_low(self) -> bool:
        """Whether no value is too low."""
        return self.low == -np.inf

    @property
    def open_high(self) -> bool:
        """Whether no value is too high."""
        return self.high == np.inf


@takes(result=FitResult)
@float64
def profile_likelihood(
    result: FitResult, names: Sequence[str] | None = None, *, level: float = 0.95
) -> dict[str, ProfileInterval]:
    """Intervals by profile likelihood, calibrated for correlated residuals; see the module.

    **Arguments:**

    - `result`: of a fit with squares as its loss.
    - `names`: of the parameters, as in `result.parameters`; by default all that were fitted.
    - `level`: the share of recordings whose interval is to hold the truth.

    Unlike `Estimate.interval`, ends need not lie evenly about the value, and stay inside bounds. A
    parameter that the data do not fix has infinite ends. Raises `ModelError` for a name that was
    not fitted, a robust loss, or where a fit on the way ends lower than the optimum.

    >>> from fitting import fit, profile_likelihood
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> recording, _ = paper_recording(samples=400, periods=2)
    >>> result = fit(paper_device(), recording, starts=2, hold_out=False)
    >>> zeta = profile_likelihood(result, ["zeta"])["zeta"]
    >>> zeta.low < 6.7126e-3 < zeta.high  # V/Hz: the true value
    True
    """
    from scipy.special import chdtri

    if not 0.0 < level < 1.0:
        raise ValueError(f"Argument `level` must lie between 0 and 1, but is {level}.")
    fitted = FittedProblem.of(result)
    if names is None:
        own = {fitted.problem.constant} if fitted.problem.own_origin else set()
        known = {p.name for p in result.parameters if not p.held} - own
        names = [p.name for p in result.parameters if p.name in known & set(result.names)]
    reach = float(np.sqrt(chdtri(1.0, 1.0 - level)))  # of the root of chi-square
    units = {p.name: p.unit for p in result.parameters}
    return {
        name: _interval(fitted, name, units.get(name, ""), level, reach)
        for name in dict.fromkeys(names)
    }


def _interval(
    fitted: FittedProblem, name: str, unit: str, level: float, reach: float
) -> ProfileInterval:
    at = fitted.index(name)
    value = float(fitted.solution.values[at])
    stderr = float(fitted.uncertainty.stderr[at])

    def known(low: float, high: float, remark: str, bound: bool = False, **more: Any):
        return ProfileInterval(name, value, low, high, level, unit, bound, remark=remark, **more)

    if not np.isfinite(stderr):
        remark = "the data do not fix it"
        return known(-np.inf, np.inf, remark, calibration=np.nan, evaluations=0)
    partner = _bound_partner(fitted, at)
    if partner:
        remark = f"its bound moves with {partner}, and is not known where either is held"
        return known(-np.inf, np.inf, remark, calibration=np.nan, evaluations=0)
    curve = _Profile.of(fitted, at)
    (low, low_bound), (high, high_bound) = (_end(curve, side, reach) for side in (-stderr, stderr))
    remark = "" if np.isfinite([low, high]).all() else "the likelihood stays flat"
    return known(
        low, high, remark, low_bound or high_bound, calibration=curve.calibration,
        evaluations=curve.evaluations,
    )  # fmt: skip


def _bound_partner(fitted: FittedProblem, at: int) -> str:
    """The parameter with which the bound of another moves, where the fit ended beyond its own."""
    problem, values = fitted.problem, fitted.solution.values
    low = problem.vector.spread(lambda p: p.bounds[0])
    for moved, by in moving_bounds(problem):
        if at in (moved, by) and values[moved] < low[moved]:
            return problem.names[by if at == moved else moved]
    return ""


@dataclasses.dataclass(eq=False)
class _Profile:
    """The root of the calibrated ratio along one element of the vector, which is `at`.

    `along`: by how much the others move with it, to first order. `nearest`: the ends of fits so
    far, by their distance.
    """

    fitted: FittedProblem
    problem: Problem
    at: int
    along: np.ndarray
    calibration: float
    bounds: tuple[float, float]
    nearest: dict[float, np.ndarray]
    evaluations: int = 0

    @classmethod
    def of(cls, fitted: FittedProblem, at: int) -> "_Profile":
        """That along the element `at`; `ModelError` where it is none of the model's."""
        problem, plain = fitted.problem, fitted.plain
        free = problem.free.copy()
        if at >= free.size:
            raise ModelError(
                f"{problem.names[at]!r} is no parameter of the model: offsets, drifts and initial "
                "fractions are not profiled."
            )
        free[at] = False
        held = dataclasses.replace(problem, free=free, linear=problem.linear & free)
        low, high = (float(b) for b in problem.vector.spread(lambda p: p.bounds)[at])
        along = plain[:, at] / plain[at, at]
        calibration = float(fitted.uncertainty.covariance[at, at] / plain[at, at])
        start = {0.0: fitted.solution.values}
        return cls(fitted, held, at, along, calibration, (low, high), start)

    def root(self, distance: float) -> float:
        """The root of the calibrated ratio at `distance` from the optimum; 0 there."""
        fitted, problem = self.fitted, self.problem
        origin = min(self.nearest, key=lambda d: abs(d - distance))
        start = self.nearest[origin] + (distance - origin) * self.along
        moves = np.ones(start.size, dtype=bool)
        moves[: problem.vector.size] = problem.free
        start = project_into_bounds(fitted.problem, start, moves)
        start[self.at] = fitted.solution.values[self.at] + distance
        end = problem.solve(start, fitted.weight, OPTIONS)
        self.evaluations += 1
        self.nearest[distance] = end.values
        ratio = 2.0 * (end.cost - fitted.solution.cost) / self.calibration
        if ratio < -THRESHOLDS.profile_lower:
            raise ModelError(
                f"with {problem.names[self.at]} held at {start[self.at]:.6g} a fit ends lower than "
                f"the optimum, by {-ratio:.2g} of chi-square: that was a local one. Fit again with "
                "more `starts`, or from there."
            )
        return float(np.sqrt(max(ratio, 0.0)))


def _end(curve: _Profile, stderr: float, reach: float) -> tuple[float, bool]:
    """One end, on the side of `stderr`'s sign, and whether it is a bound."""
    value = float(curve.fitted.solution.values[curve.at])
    bound = curve.bounds[0] if stderr < 0 else curve.bounds[1]
    room = abs(bound - value) * (1.0 - THRESHOLDS.profile_bound)  # infinite without a bound
    size, sign = abs(stderr), np.sign(stderr)
    inner, inside = 0.0, -reach
    outer = min(reach * size, room)
    while True:
        outside = curve.root(sign * outer) - reach
        if outside >= 0.0:
            break
        if outer >= room:
            return bound, True
        if outer >= THRESHOLDS.profile_reach * size:
            return float(sign * np.inf), False
        inner, inside = outer, outside
        outer = min(2.0 * outer, room)
    middle, here = outer, outside
    for _ in range(THRESHOLDS.profile_evaluations):
        if abs(here) <= THRESHOLDS.profile_end:
            break
        # The root is near a straight line: regula falsi, by the Illinois rule.
        middle = outer - outside * (outer - inner) / (outside - inside)
        here = curve.root(sign * middle) - reach
        if here >= 0.0:
            outer, outside, inside = middle, here, inside / 2.0
        else:
            inner, inside, outside = middle, here, outside / 2.0
    return value + float(sign * middle), False
