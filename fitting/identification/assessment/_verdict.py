"""The verdict on a fit: trusted or not, by gradient, rank, agreeing starts and held-out data."""

import dataclasses

import numpy as np

from fitting._units import quantity
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks.holds._sweeps import single_sweep
from fitting.identification.problem._problem import Problem, Solution
from fitting.identification.robust._reweighting import Reweighting

from ._claim import Claim
from ._convergence import unidentifiable
from ._cross_validation import HeldOut
from ._ends import Start
from ._noise import Noise
from ._notes import describe_open_points
from ._reasons import check_convergence, check_held_out, check_misfit, check_rank, check_starts


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
        *check_rank(undetermined),
        *check_convergence(problem, weight, solution, rmse, span),
        *([] if reweighting is None else reweighting.reasons()),
        *check_starts(starts),
        *(f"{fault.kind}: {fault.message}" for fault in faults if not fault.left_out),
        *check_misfit(problem, rmse, span, noise, claim),
    ]
    unit = problem.recording.response_unit
    repeats = any(run.drive.periods > 1 for run in problem.recording.runs)
    failures, notes = check_held_out(held_out, span, noise.total, repeats=repeats, unit=unit)
    reasons += failures
    notes += [f"{fault.kind}: {fault.message}" for fault in faults if fault.left_out]
    with_gap = not reasons and rmse > THRESHOLDS.with_gap * noise.total
    with_gap = with_gap and rmse > THRESHOLDS.exact_fit * span
    if with_gap:
        notes.append(_gap_note(rmse, noise, problem.recording.response_unit))
    notes += describe_open_points(problem, solution, stderr, undetermined)
    notes += [] if reweighting is None else reweighting.notes(data.use)
    return Verdict(not reasons, tuple(reasons), tuple(notes), undetermined, with_gap)


def _gap_note(rmse: float, noise: Noise, unit: str) -> str:
    estimated = "the noise (estimated from differences between samples)"
    known = "the noise" if noise.repeated.all() else estimated
    left, total = quantity(rmse, unit), quantity(noise.total, unit)
    return (
        f"gap: the model leaves {left} rms, {known} is {total} rms. The claimed error includes "
        "this gap; `rapi diagnose` says what causes it."
    )
