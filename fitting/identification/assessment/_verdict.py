"""The verdict on a fit: trusted or not, by gradient, rank, agreeing starts and held-out data."""

import dataclasses
import operator

import equinox as eqx
import jax
import numpy as np

from fitting.identification._parameter_vector import as_device
from fitting.identification._problem import Problem, Solution
from fitting.identification._starts import Start
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.data_checks._data_checks import Fault
from rapi_jax.internal import Band

from ._convergence import gain_tolerance, remaining_step, unidentifiable
from ._cross_validation import HeldOut


@dataclasses.dataclass(frozen=True)
class Verdict:
    """`trusted` with no reasons, or not with at least one; `notes` do not speak against the fit."""

    trusted: bool
    reasons: tuple[str, ...]
    notes: tuple[str, ...]
    unidentifiable: tuple[str, ...] = ()


def judge(
    problem: Problem,
    weight: np.ndarray,
    solution: Solution,
    starts: list[Start],
    held_out: list[HeldOut],
    faults: list[Fault],
    stderr: np.ndarray,
) -> Verdict:
    """The verdict on a fit. `weight` is of the samples, `stderr` of the problem's vector."""
    data = problem.data
    error = solution.error[data.use]
    rmse = float(np.sqrt(np.mean(error**2)))
    span = max(float(np.ptp(data.y[r, data.use[r]])) for r in range(data.y.shape[0]))
    undetermined = unidentifiable(problem, solution)
    reasons = [
        *_check_rank(undetermined),
        *_check_convergence(problem, weight, solution, rmse, span),
        *_check_starts(starts),
        *(f"{fault.kind}: {fault.message}" for fault in faults),
        *_check_misfit(problem, rmse, span),
    ]
    failures, notes = _check_held_out(held_out, span)
    reasons += failures
    notes += _notes(problem, solution, stderr, undetermined)
    return Verdict(not reasons, tuple(reasons), tuple(notes), undetermined)


def _check_rank(undetermined: tuple[str, ...]) -> list[str]:
    if not undetermined:
        return []
    return [
        f"unidentifiable: these data cannot fix {', '.join(undetermined)}. Hold one of them "
        "(`free=` in Python), or add a scan rate, an amplitude or a longer swing."
    ]


def _check_convergence(
    problem: Problem, weight: np.ndarray, solution: Solution, rmse: float, span: float
) -> list[str]:
    exact = rmse <= THRESHOLDS.exact_fit * max(span, 1e-300)
    gain, _ = remaining_step(problem, solution, weight)
    if exact or gain <= gain_tolerance(problem, weight):
        return []
    return [
        f"not converged: one more step takes away {100 * gain:.2g} % of the cost "
        f"({solution.solver.reason or 'the solver stopped early'}). More starts or a better "
        "first model."
    ]


def _check_starts(starts: list[Start]) -> list[str]:
    if len(starts) == 1:
        return ["one start only: nothing says that the end is not a local minimum."]
    if sum(start.agrees for start in starts) < 2:
        return [
            f"starts disagree: {len(starts)} starts reached {len(starts)} different ends, so the "
            "best may be a local minimum. Raise `starts`, or hold what you know."
        ]
    return []


def _check_misfit(problem: Problem, rmse: float, span: float) -> list[str]:
    """The residual against the response's span and variance."""
    data = problem.data
    variance = float(np.mean([np.var(data.y[r, data.use[r]]) for r in range(data.y.shape[0])]))
    if span == 0:
        return ["no signal: the response never changes."]
    if rmse**2 > (1.0 - THRESHOLDS.explained_variance) * variance:
        return [
            f"nothing explained: the model leaves {100 * rmse**2 / variance:.0f} % of the "
            "response's variance. The response does not follow this drive; check wiring, columns "
            "and lag."
        ]
    if rmse > THRESHOLDS.poor_fit * span:
        return [
            f"poor fit: rmse is {100 * rmse / span:.1f} % of the span. More plays (`plays`) or "
            "order, an effect the model lacks, or a wrong lag."
        ]
    return []


def _check_held_out(held_out: list[HeldOut], span: float) -> tuple[list[str], list[str]]:
    """Reasons and notes: a model has to predict the last third, but not to extrapolate."""
    reasons, notes = [], []
    for scheme in held_out:
        limit = THRESHOLDS.generalisation * scheme.train_rmse + THRESHOLDS.exact_fit * span
        if scheme.rmse > limit and scheme.fraction > THRESHOLDS.held_out_error:
            text = (
                f"{scheme.scheme}: held-out rmse {scheme.rmse:.3g} is "
                f"{scheme.rmse / scheme.train_rmse:.1f} times that of the fitted part"
            )
            if scheme.scheme == "last third":
                reasons.append(
                    f"does not generalise: {text}. Fewer parameters, or a drift to model."
                )
            else:
                notes.append(f"{text}: do not extrapolate there.")
    return reasons, notes


def _notes(
    problem: Problem, solution: Solution, stderr: np.ndarray, undetermined: tuple[str, ...]
) -> list[str]:
    notes = []
    recording = problem.recording
    if max(recording.rates) <= THRESHOLDS.one_rate * min(recording.rates):
        notes.append(
            f"one scan rate: the rate dependence{_named(problem, 'zeta', 'kappa')} rests on the "
            "shape of one loop, and a lag of the device or its reading (delay, amplifier, servo) "
            "cannot be told from hysteresis. Record a second rate before predicting at another."
        )
    if len(recording.amplitudes) == 1:
        notes.append(
            f"one amplitude: how thresholds grow with amplitude{_named(problem, 'alpha')} is "
            "assumed, not measured."
        )
    names = problem.names
    bound = [
        n
        for n, at in zip(problem.vector.names, bounded_parameters(problem, solution), strict=True)
        if at
    ]
    if bound:
        notes.append(
            f"at a bound: {', '.join(bound)}. The data ask for less or more than is allowed."
        )
    values = solution.values
    weak = [
        names[i]
        for i in range(problem.vector.size)
        if problem.free[i]
        and names[i] not in undetermined
        and stderr[i] > abs(values[i])
        and values[i] != 0
    ]
    if weak:
        notes.append(f"known no better than their own size: {', '.join(weak)}.")
    if recording.response_origin == "run":
        notes.append(
            f"each run has an origin of its own: {problem.constant} is their mean, and says "
            "nothing."
        )
    notes += _band_notes(problem, solution)
    return notes


def _named(problem: Problem, *names: str) -> str:
    found = [name for name in names if any(part.name == name for part in problem.vector.parts)]
    return f" ({found[0]})" if found else ""


def bounded_parameters(problem: Problem, solution: Solution) -> np.ndarray:
    """Which of the model's parameters ended at a bound."""
    return solution.solver.at_bound[: problem.vector.size] & problem.free & ~problem.linear


def _band_notes(problem: Problem, solution: Solution) -> list[str]:
    """Crossed bands and thresholds that are not positive, with where."""
    runs = problem.recording.runs
    ends = np.array([[0.0, run.drive.value.min(), run.drive.value.max()] for run in runs])
    plays, centred = jax.tree_util.tree_map(
        np.asarray,
        _plays_of_runs(
            problem.model(solution.values).operator,
            *map(as_device, (problem.data.u_pp, problem.data.freq, ends)),
        ),
    )
    notes = []
    for row, run in enumerate(runs):
        band = Band.of(jax.tree_util.tree_map(operator.itemgetter(row), plays))
        zero, low, high = map(float, centred[row])
        if (band.r <= 0).any():
            notes.append(
                f"run {run.name!r}: threshold of play {int(np.argmin(band.r)) + 1} is "
                f"{band.r.min():.3g}, not positive: that play has no memory there."
            )
        crossed = band.crossed_stretches(low, high)
        if crossed:
            play, begin, end = crossed[0]
            notes.append(
                f"run {run.name!r}: the band of play {play} is crossed from {begin - zero:.3g} "
                f"to {end - zero:.3g} {problem.recording.drive_unit}: no memory there, but still "
                "monotone."
            )
    return notes


@eqx.filter_jit
def _plays_of_runs(model, u_pp, freq, drives):
    """The plays of each run, and `drives` (`runs any`) counted from the operator's origin."""
    return jax.vmap(model.plays)(u_pp, freq), model.centred(drives)
