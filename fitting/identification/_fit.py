"""`fit`: identify a model on all runs of a recording at once (Eqs. 25 to 27)."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.solver._refinement import refine
from rapi_jax import ECDL, RAPI, DataError, GeneralRAPI, InverseRAPI, Recording, parameters
from rapi_jax._precision import float64

from ._covariance import Uncertainty, correlated_covariance
from ._cross_validation import KINDS, cross_validate
from ._data_checks import check_usable, find_faults, find_hops
from ._problem import Problem, Solution
from ._result import Estimate, FitResult, RunFit, UntrustedFit
from ._starts import search_starts
from ._verdict import bounded_parameters, judge
from ._weights import hysteresis_fraction, run_weights

Progress = Callable[[str], None]
_OPTIONS = {"tolerance": 1e-6, "slope": 1e-5}


def default_free(ecdl: ECDL, recording: Recording) -> Callable[[ECDL], Any]:
    """What a fit frees unless told: the operator, less what these data cannot tell from the rest.

    Only `r (1 + eta)` and `b r` are seen in one scan, up to an offset. So with one rate and
    amplitude, or an origin of its own for every run, `eta` is held (where it has a value for each
    play, `alpha`).
    Where no run has a scan rate, `zeta` is held too. Of a `GeneralRAPI` the same and `u_0`, which
    `lam` and `eta` follow; with one rate and amplitude also `alpha`, which `zeta` there says all
    about (where `alpha` or `eta` has a value for each play, `zeta`), and with an `a` for each play
    `b`. Of an `InverseRAPI` the origin `v_0` is held,
    and with one rate `kappa` and `eta` (where it has a value for each play, `s_1` to `s_3`).
    """
    operator = ecdl.operator
    if isinstance(operator, InverseRAPI):
        held = _held_inverse(operator, recording)
    elif isinstance(operator, GeneralRAPI):
        held = _held_general(operator, recording)
    elif isinstance(operator, RAPI):
        held = _held(operator, recording)
    else:
        return lambda e: e.operator
    names = [p.name for p in parameters(operator) if p.name not in held]
    return lambda e: tuple(getattr(e.operator, name) for name in names)


def _held(operator: RAPI | GeneralRAPI, recording: Recording) -> set[str]:
    held = set()
    if _one_kind(recording) or recording.response_origin == "run":
        held.add("alpha" if jnp.ndim(operator.eta) > 0 else "eta")
    if max(recording.rates) == 0:
        held.add("zeta")
    return held


def _one_kind(recording: Recording) -> bool:
    return len({(d.rate, round(d.u_pp, 6)) for d in recording.drives}) == 1


def _held_general(operator: GeneralRAPI, recording: Recording) -> set[str]:
    held = _held(operator, recording) | {"u_0"}
    if _one_kind(recording):
        each = jnp.ndim(operator.alpha) > 0 or jnp.ndim(operator.eta) > 0
        if "zeta" not in held:
            held.add("zeta" if each else "alpha")
        if jnp.ndim(operator.a) > 0:
            held.add("b")
    return held


def _held_inverse(operator: InverseRAPI, recording: Recording) -> set[str]:
    thresholds = ("s_1", "s_2", "s_3")
    held = {"v_0", *thresholds[: max(3 - operator.count, 0)]}
    if len(recording.rates) == 1:
        held |= {"kappa"} | (set(thresholds) if jnp.ndim(operator.eta) > 0 else {"eta"})
    return held


@float64
def fit(
    ecdl: ECDL,
    recording: Recording,
    *,
    free: Callable[[ECDL], Any] | None = None,
    weights: str | Sequence[float] = "hysteresis",
    starts: int = 6,
    guess: bool | Sequence[ECDL] = True,
    history: bool = True,
    drift: bool | None = None,
    hold_out: bool | tuple[str, ...] = True,
    max_steps: int = 120,
    throw: bool = True,
    progress: Progress | None = None,
) -> FitResult:
    """Identify the free parameters of `ecdl` on `recording`.

    **Arguments:**

    - `ecdl`: the model to fit; its values are one of the starts.
    - `free`: selects what may move, as in `equinox.tree_at`: `lambda e: e.operator`, or
      `lambda e: (e.operator.lam, e.effects[-1])`. Default: see `default_free`.
    - `weights`: `A_j` of Eq. 26: "hysteresis" (its percentage), "uniform", or one number a run.
    - `starts`: at most so many starts; two that agree on the best end are enough.
    - `guess`: let first guesses from the data be among the starts; or models to use as such.
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
    """
    began = time.perf_counter()
    say = progress or (lambda line: None)
    chosen = default_free(ecdl, recording) if free is None else free
    check_usable(recording)
    problem = Problem.of(ecdl, recording, chosen, history=history, drift=drift)
    _check_size(problem)
    per_run_weight = run_weights(recording, weights)
    weight = problem.weights(per_run_weight)
    say("starts")
    options: dict[str, Any] = _OPTIONS | {"max_steps": max_steps}
    solution, ends = search_starts(problem, weight, starts, guess=guess, **options)
    solution = refine(problem, weight, solution, **options)
    say("standard errors")
    spread = _uncertainty(problem, solution, per_run_weight)
    held = []
    if hold_out:
        say("held-out data")
        kinds = KINDS if hold_out is True else hold_out
        held = cross_validate(problem, per_run_weight, solution, kinds, **options)
    found = find_faults(recording) + find_hops(recording, per_run(problem, solution.error))
    verdict = judge(problem, weight, solution, ends, held, found, spread.stderr)
    result = _collect(problem, solution, spread, per_run_weight, verdict, held, ends, found, began)
    if throw and not verdict.trusted:
        raise UntrustedFit(result)
    return result


def _check_size(problem: Problem) -> None:
    samples = int(problem.data.use.sum())
    if samples <= problem.free_count:
        raise DataError(
            f"{samples} usable samples cannot fix {problem.free_count} parameters. Record more, or "
            "fit fewer plays or a lower order."
        )


def per_run(problem: Problem, rows: np.ndarray) -> list[np.ndarray]:
    """Rows of "runs time" cut to the samples of each run."""
    return [
        rows[i, problem.data.sample[i] >= 0][: r.drive.size]
        for i, r in enumerate(problem.recording.runs)
    ]


def _uncertainty(problem: Problem, solution: Solution, run_weights: np.ndarray) -> Uncertainty:
    """Covariance of the problem's vector, its constant and run offsets shared as in the values."""
    use = problem.data.use
    shaped = solution.jacobian.reshape(*use.shape, -1)
    free = np.linalg.norm(solution.jacobian, axis=0) > 0
    root = np.sqrt(run_weights)
    jacobians = [shaped[row, use[row]][:, free] / root[row] for row in range(use.shape[0])]
    residuals = [solution.error[row, use[row]] for row in range(use.shape[0])]
    part = correlated_covariance(residuals, jacobians, list(run_weights))
    size = solution.values.size
    covariance = np.zeros((size, size))
    covariance[np.ix_(free, free)] = part.covariance
    if problem.own_origin:
        n, k = problem.vector.size, problem.offsets
        share = np.eye(size)
        share[n : n + k, n : n + k] -= 1.0 / k
        share[problem.vector.names.index(problem.constant), n : n + k] = 1.0 / k
        loose = ~np.isfinite(np.diag(covariance))
        known = np.where(np.isfinite(covariance), covariance, 0.0)
        covariance = share @ known @ share.T
        covariance[loose, loose] = np.inf
    return Uncertainty(covariance, part.rho, part.effective)


def _collect(
    problem, solution, spread, run_weights, verdict, held, ends, found, began
) -> FitResult:
    recording, data = problem.recording, problem.data
    n = problem.vector.size
    stderr = spread.stderr
    units = problem.vector.units(recording.response_unit, recording.drive_unit)
    low = problem.vector.spread(lambda p: p.bounds[0])
    high = problem.vector.spread(lambda p: p.bounds[1])
    at = bounded_parameters(problem, solution)
    loose = set(verdict.unidentifiable)
    estimates = tuple(
        Estimate(
            name,
            float(solution.values[i]),
            np.inf if name in loose else float(stderr[i]),
            units[i],
            float(low[i]),
            float(high[i]),
            bool(at[i]),
            not bool(problem.free[i]),
        )
        for i, name in enumerate(problem.vector.names)
    )
    moving = [i for i in range(solution.values.size) if stderr[i] > 0]
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
                opening=hysteresis_fraction(run, recording.response_lag_s),
                weight=float(run_weights[row]),
                rho=spread.rho[row],
                offset=float(solution.values[n + row]) if problem.offsets else 0.0,
            )
        )
    return FitResult(
        ecdl=problem.model(solution.values),
        recording=recording,
        verdict=verdict,
        parameters=estimates,
        runs=tuple(runs),
        rmse=float(np.sqrt(np.mean(solution.error[data.use] ** 2))),
        held_out=tuple(held),
        starts=tuple(ends),
        faults=tuple(found),
        names=tuple(problem.names[i] for i in moving),
        correlation=spread.correlation[np.ix_(moving, moving)],
        effective=spread.effective,
        predicted=tuple(per_run(problem, solution.error + data.y)),
        used=tuple(per_run(problem, data.use)),
        seconds=time.perf_counter() - began,
    )
