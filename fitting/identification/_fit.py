"""`fit`: identify the free parameters of a model on all runs of a recording (Eqs. 25 to 27)."""

import time
from collections.abc import Callable, Sequence
from typing import Any

import jax.numpy as jnp
import numpy as np

from fitting.solver._least_squares import SolverOptions
from rapi_jax import ECDL, RAPI, DataError, GeneralRAPI, InverseRAPI, Recording, parameters
from rapi_jax.internal import float64

from ._convergence import refine
from ._covariance import estimate_uncertainty
from ._cross_validation import KINDS, cross_validate
from ._data_checks import check_usable, find_faults, find_mode_hops
from ._estimates import cut_to_runs, estimate_parameters, summarise_runs
from ._problem import Problem
from ._result import FitResult, UntrustedFit
from ._starts import search_starts
from ._thresholds import THRESHOLDS
from ._verdict import judge
from ._weights import run_weights

Progress = Callable[[str], None]


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
    report = progress or (lambda line: None)
    options = SolverOptions(THRESHOLDS.solver_tolerance, THRESHOLDS.solver_slope, max_steps)
    check_usable(recording)
    chosen = default_free(ecdl, recording) if free is None else free
    problem = Problem.of(ecdl, recording, chosen, history=history, drift=drift)
    _check_size(problem)
    per_run = run_weights(recording, weights)
    weight = problem.weights(per_run)
    report("starts")
    solution, ends = search_starts(problem, weight, starts, options, guess=guess)
    solution = refine(problem, weight, solution, options)
    report("standard errors")
    uncertainty = estimate_uncertainty(problem, solution, per_run)
    held_out = []
    if hold_out:
        report("held-out data")
        kinds = KINDS if hold_out is True else hold_out
        held_out = cross_validate(problem, per_run, solution, kinds, options=options)
    errors = cut_to_runs(problem, solution.error)
    faults = find_faults(recording) + find_mode_hops(recording, errors)
    verdict = judge(problem, weight, solution, ends, held_out, faults, uncertainty.stderr)
    result = FitResult(
        ecdl=problem.model(solution.values),
        recording=recording,
        verdict=verdict,
        parameters=estimate_parameters(problem, solution, uncertainty, verdict),
        runs=summarise_runs(problem, solution, uncertainty, per_run),
        rmse=float(np.sqrt(np.mean(solution.error[problem.data.use] ** 2))),
        held_out=tuple(held_out),
        starts=tuple(ends),
        faults=tuple(faults),
        names=tuple(problem.names[i] for i in uncertainty.fitted),
        correlation=uncertainty.fitted_correlation,
        effective=uncertainty.effective,
        predicted=tuple(cut_to_runs(problem, solution.error + problem.data.y)),
        used=tuple(cut_to_runs(problem, problem.data.use)),
        seconds=time.perf_counter() - began,
    )
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
