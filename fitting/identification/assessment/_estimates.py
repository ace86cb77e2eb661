"""Parameter estimates and errors of each run, from a fitted problem."""

import dataclasses
from typing import Any

import numpy as np

from fitting.identification._weights import hysteresis_fraction
from fitting.identification.problem._problem import Problem, Solution

from ._covariance import Uncertainty
from ._notes import bounded_parameters
from ._verdict import Verdict


@dataclasses.dataclass(frozen=True)
class Estimate:
    """One parameter: `stderr` is 0 for one that was held, infinite for one the data cannot fix.

    >>> from fitting import Estimate
    >>> alpha = Estimate("alpha", 0.28, 0.01, "1", 0.0, 1.0, at_bound=False, held=False)
    >>> [round(float(end), 3) for end in alpha.interval(0.95)]
    [0.26, 0.3]
    """

    name: str
    value: float
    stderr: float
    unit: str
    low: float
    high: float
    at_bound: bool
    held: bool

    def interval(self, level: float = 0.95, degrees: float = np.inf) -> tuple[float, float]:
        """Confidence interval at `level`, by Student's t with `degrees` of freedom."""
        from scipy.special import stdtrit

        half = float(stdtrit(min(degrees, 1e9), 0.5 + level / 2.0)) * self.stderr
        return self.value - half, self.value + half


@dataclasses.dataclass(frozen=True)
class RunFit:
    """One run: errors over the samples that were fitted, in the response's unit.

    `hysteresis`: the hysteresis percentage as a fraction; `weight`: its `A_j`; `rho`: correlation
    of the residual from sample to sample; `offset`: the run's own origin less their mean.
    """

    name: str
    excitation_hz: float | None
    samples: int
    periods: int
    rmse: float
    span: float
    rmse_fraction: float
    hysteresis: float
    weight: float
    rho: float
    offset: float

    def to_dict(self) -> dict[str, Any]:
        """The fields as in `model.json`, where the hysteresis fraction is called `opening`."""
        names = {"hysteresis": "opening"}
        return {names.get(key, key): value for key, value in dataclasses.asdict(self).items()}


def cut_to_runs(problem: Problem, rows: np.ndarray) -> list[np.ndarray]:
    """Rows of "runs time" cut to the samples of each run."""
    return [
        rows[i, problem.data.sample[i] >= 0][: r.drive.size]
        for i, r in enumerate(problem.recording.runs)
    ]


def estimate_parameters(
    problem: Problem, solution: Solution, uncertainty: Uncertainty, verdict: Verdict
) -> tuple[Estimate, ...]:
    """The model's parameters with standard errors, units and bounds."""
    vector, recording = problem.vector, problem.recording
    stderr = uncertainty.stderr
    units = vector.units(recording.response_unit, recording.drive_unit)
    low = vector.spread(lambda p: p.bounds[0])
    high = vector.spread(lambda p: p.bounds[1])
    at_bound = bounded_parameters(problem, solution)
    return tuple(
        Estimate(
            name,
            float(solution.values[i]),
            np.inf if name in verdict.unidentifiable else float(stderr[i]),
            units[i],
            float(low[i]),
            float(high[i]),
            bool(at_bound[i]),
            not bool(problem.free[i]),
        )
        for i, name in enumerate(vector.names)
    )


def summarise_runs(
    problem: Problem, solution: Solution, uncertainty: Uncertainty, run_weights: np.ndarray
) -> tuple[RunFit, ...]:
    """Errors of each run over the samples that were fitted."""
    recording, data = problem.recording, problem.data
    runs = []
    for row, run in enumerate(recording.runs):
        error = solution.error[row, data.use[row]]
        rmse = float(np.sqrt(np.mean(error**2)))  # Eq. (27)
        span = float(np.ptp(data.y[row, data.use[row]]))
        runs.append(
            RunFit(
                name=run.name,
                excitation_hz=run.drive.excitation_hz,
                samples=int(data.use[row].sum()),
                periods=run.drive.periods,
                rmse=rmse,
                span=span,
                rmse_fraction=rmse / span if span > 0 else float("nan"),
                hysteresis=hysteresis_fraction(run, recording.response_lag_s),
                weight=float(run_weights[row]),
                rho=uncertainty.rho[row],
                offset=float(solution.values[problem.vector.size + row])
                if problem.offsets
                else 0.0,
            )
        )
    return tuple(runs)
