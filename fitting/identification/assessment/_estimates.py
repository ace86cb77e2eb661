"""Parameter estimates and errors of each run, from a fitted problem."""

import numpy as np

from fitting.identification._result import Estimate, RunFit
from fitting.identification._weights import hysteresis_fraction
from fitting.identification.problem._problem import Problem, Solution

from ._covariance import Uncertainty
from ._notes import bounded_parameters
from ._verdict import Verdict


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
