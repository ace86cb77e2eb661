"""The verdict on a fit: trusted or not, by gradient, rank, agreeing starts and held-out data."""

import dataclasses
import operator

import equinox as eqx
import jax
import numpy as np

from fitting._units import quantity
from fitting.identification._parameter_vector import as_device
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.data_checks._clock_jitter import describe_jitter
from fitting.identification.data_checks._drive_character import describe_repetition
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks.holds._sweeps import describe_creep, single_sweep
from fitting.identification.problem._problem import Problem, Solution
from fitting.identification.robust._reweighting import Reweighting
from rapi_jax.internal import Band

from ._claim import Claim
from ._convergence import gain_tolerance, remaining_step, unidentifiable
from ._cross_validation import HeldOut
from ._ends import Start
from ._noise import Noise


@dataclasses.dataclass(frozen=True)
class Verdict:
    """`trusted` with no reasons, or not with at least one; `notes` do not speak against the fit.

    `with_gap`: trusted, though what is left is more than noise; the claim covers it.

    >>> from fitting import Verdict
    >>> verdict = Verdict(False, ("single sweep: nothing tests what was fitted",), ())
    >>> verdict.trusted, verdict.reasons
    (False, ('single sweep: nothing tests what was fitted',))
    """

    trusted: bool
    reasons: tuple[str, ...]
    notes: tuple[str, ...]
    unidentifiable: tuple[str, ...] = ()
    with_gap: bool = False


def judge(
    problem: Problem,
    weight: np.ndarray,
    solution: Solution,
    starts: list[Start],
    held_out: list[HeldOut],
    faults: list[Fault],
    stderr: np.ndarray,
    noise: Noise,
    claim: Claim | None,
    reweighting: Reweighting | None = None,
) -> Verdict:
    """The verdict on a fit. `weight` is of the samples, `stderr` of the problem's vector."""
    data = problem.data
    judged = solution.error if reweighting is None else reweighting.judged(solution.error)
    error = judged[data.use]
    rmse = float(np.sqrt(np.mean(error**2)))
    span = max(float(np.ptp(data.y[r, data.use[r]])) for r in range(data.y.shape[0]))
    undetermined = unidentifiable(problem, solution)
    sweep = single_sweep(problem.recording)
    reasons = [
        *([] if sweep is None else [sweep]),
        *_check_rank(undetermined),
        *_check_convergence(problem, weight, solution, rmse, span),
        *([] if reweighting is None else reweighting.reasons()),
        *_check_starts(starts),
        *(f"{fault.kind}: {fault.message}" for fault in faults if not fault.left_out),
        *_check_misfit(problem, rmse, span, noise, claim),
    ]
    unit = problem.recording.response_unit
    repeats = any(run.drive.periods > 1 for run in problem.recording.runs)
    failures, notes = _check_held_out(held_out, span, noise.total, repeats=repeats, unit=unit)
    reasons += failures
    notes += [f"{fault.kind}: {fault.message}" for fault in faults if fault.left_out]
    with_gap = not reasons and rmse > THRESHOLDS.with_gap * noise.total
    with_gap = with_gap and rmse > THRESHOLDS.exact_fit * span
    if with_gap:
        notes.append(_gap_note(rmse, noise, problem.recording.response_unit))
    notes += _notes(problem, solution, stderr, undetermined)
    notes += [] if reweighting is None else reweighting.notes(data.use)
    return Verdict(not reasons, tuple(reasons), tuple(notes), undetermined, with_gap)


def _gap_note(rmse: float, noise: Noise, unit: str) -> str:
    known = "the noise" if noise.repeated.all() else "what changes from sample to sample"
    left, total = quantity(rmse, unit), quantity(noise.total, unit)
    return (
        f"gap: the model leaves {left} rms, {known} is {total}. The claim includes it; "
        "`rapi diagnose` says what causes it."
    )


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


def _check_misfit(
    problem: Problem, rmse: float, span: float, noise: Noise, claim: Claim | None
) -> list[str]:
    """The residual against the response's variance, what is not noise against its curvature."""
    data = problem.data
    variance = float(np.mean([np.var(data.y[r, data.use[r]]) for r in range(data.y.shape[0])]))
    if span == 0:
        return ["no signal: the response never changes."]
    if rmse**2 > (1.0 - THRESHOLDS.explained_variance) * variance:
        return [
            f"nothing explained: the model leaves {100 * rmse**2 / variance:.0f} % of the "
            "response's variance. The response does not follow this drive: check wiring, columns "
            "and lag. Or it turns back while the drive goes on, as a butterfly loop and a folded "
            "reading do: no model of this kind describes that; record a drive that stays on one "
            "side of the turn."
        ]
    gap, curved = noise.gap(rmse), np.inf if claim is None else claim.curvature
    if gap > THRESHOLDS.poor_gap * curved and gap > THRESHOLDS.exact_fit * span:
        left = quantity(gap, problem.recording.response_unit)
        return [
            f"poor fit: beyond noise the model leaves {left} rms, {100 * gap / curved:.0f} % of "
            "what the response curves by, so that a compensated scan would keep as much. More "
            "plays (`plays`) or order, a drift, a wrong lag, or an effect the model lacks "
            "(`rapi diagnose`)."
        ]
    return []


def _check_held_out(
    held_out: list[HeldOut], span: float, noise: float, *, repeats: bool, unit: str = ""
) -> tuple[list[str], list[str]]:
    """Reasons and notes: a model has to predict what lies between runs, but not to extrapolate.

    `repeats`: whether some run holds two periods or more. `unit`: of the response; without one
    errors are plain numbers.
    """
    reasons, notes = [], []
    cure = (
        "Fewer parameters, or a drift to model."
        if repeats
        else "No run repeats, so that the drive may go there where it went nowhere before: record "
        "three periods or more. Else fewer parameters, or a drift to model."
    )
    for scheme in held_out:
        if not scheme.exceeds(noise, span):
            continue
        usual = scheme.usual(noise)
        times = f"{scheme.rmse / usual:.1f} times that of" if usual > 0 else "not the zero of"
        size = quantity(scheme.rmse, unit) if unit else f"{scheme.rmse:.3g}"
        text = f"{scheme.scheme}: held-out rmse {size} is {times} the fitted part"
        if scheme.scheme == "last third" and scheme.large:
            reasons.append(f"does not generalise: {text}. {cure}")
        elif scheme.runs and scheme.inside and scheme.large:
            reasons.append(
                f"not predicted: {text}, though its rate and swing lie among those of the other "
                "runs. Look at that run, or record more there."
            )
        elif scheme.large or scheme.rmse > THRESHOLDS.extrapolation * usual:
            notes.append(f"{text}: do not extrapolate there.")
    alone = [scheme for scheme in held_out if len(scheme.runs) == 1]
    if len(alone) > 1 and all(s.large and s.exceeds(noise, span) for s in alone):
        notes.append(
            "no run is predicted from the others: the model holds at the rates and swings "
            "recorded. That they are of one device is assumed, and so is what lies between them: "
            "record a run between to test it."
        )
    return reasons, notes


def _notes(
    problem: Problem, solution: Solution, stderr: np.ndarray, undetermined: tuple[str, ...]
) -> list[str]:
    notes = []
    recording = problem.recording
    notes += describe_creep(recording)
    errors = [
        solution.error[row, problem.data.sample[row] >= 0][: run.drive.size]
        for row, run in enumerate(recording.runs)
    ]
    notes += describe_jitter(recording, errors)
    if max(recording.rates) <= THRESHOLDS.one_rate * min(recording.rates):
        which = "one scan rate" if max(recording.rates) > 0 else "no scan rate"
        notes.append(
            f"{which}: the rate dependence{_named(problem, 'zeta', 'kappa')} rests on the "
            "shape of one loop, and a lag of the device or its reading (delay, amplifier, servo) "
            "cannot be told from hysteresis. Record a second rate before predicting at another."
        )
    if len(recording.amplitudes) == 1:
        notes.append(
            f"one amplitude: how thresholds grow with amplitude{_named(problem, 'alpha')} is "
            "assumed, not measured. Record a second one, half as large, before compensating at "
            "another."
        )
    if not any(run.drive.periods > 1 for run in recording.runs):
        cure = describe_repetition(recording)
        notes.append(
            "nothing repeats: noise is taken as what changes from sample to sample. "
            + (cure or "Record three periods or more of one drive to measure it.")
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
        and names[i] not in (*undetermined, problem.constant)  # an offset has no size of its own
        and stderr[i] > abs(values[i])
        and values[i] != 0
    ]
    if weak:
        notes.append(f"standard error larger than the value: {', '.join(weak)}.")
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
                f"{band.r.min():.3g}, not positive: that play has no hysteresis there."
            )
        crossed = band.crossed_stretches(low, high)
        if crossed:
            play, begin, end = crossed[0]
            notes.append(
                f"run {run.name!r}: the two bounds of play {play} cross between "
                f"{begin - zero:.3g} and {end - zero:.3g} {problem.recording.drive_unit}: it has "
                "no hysteresis there, and its response stays monotone."
            )
    return notes


@eqx.filter_jit
def _plays_of_runs(model, u_pp, freq, drives):
    """The plays of each run, and `drives` (`runs any`) counted from the operator's origin."""
    return jax.vmap(model.plays)(u_pp, freq), model.centred(drives)
