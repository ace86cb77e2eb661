"""Whether another law of the thresholds would fit a recording clearly better: a note, no more."""

from collections.abc import Sequence

import numpy as np

from fitting._units import quantity
from fitting.identification._model_order import guess_from
from fitting.identification._options import solver_options
from fitting.identification._posed import Posed
from fitting.identification._result import FitResult
from fitting.identification._starts import held_origin
from fitting.identification._thresholds import THRESHOLDS
from fitting.identification.data_checks.periods._odd_periods import find_late_starts
from rapi_jax import RAPI, AbstractOperator, FixedRAPI, MixedRAPI
from rapi_jax.internal import float64, follow

from ._cross_validation import HeldOut, cross_validate
from ._estimates import cut_to_runs
from ._noise import after_first_period, measure_run_noise

_LAWS: dict[type[AbstractOperator], str] = {
    RAPI: "thresholds that grow with the swing",
    FixedRAPI: "thresholds fixed in {unit}",
    MixedRAPI: "thresholds that grow slower than the swing",
}

_TELL_MIXED = 3  # amplitudes: with two, a power of the swing and a sum are the same


@float64
def suggest_law(
    result: FitResult,
    weights: str | Sequence[float],
    *,
    history: bool,
    drift: bool | None,
    max_steps: int,
) -> str | None:
    """The note that an operator with another law leaves clearly less, with the command for it.

    Or that it predicts a swing that was left out clearly better, where `result` does not. One fit
    from a guess for each of the others, only where `result` leaves more than noise, and the
    amplitudes could tell. `None`: there is nothing to note.
    """
    recording, operator = result.recording, result.ecdl.operator
    amplitudes = len(recording.amplitudes)
    if type(operator) not in _LAWS or result.ecdl.effects or amplitudes < 2:
        return None
    errors = [p - run.response for p, run in zip(result.predicted, recording.runs, strict=True)]
    noise = _noise(result, errors)
    rmse = _rms(result, errors)
    if not rmse > THRESHOLDS.with_gap * noise:
        return None
    origin = held_origin(operator)
    zero = None if origin is None else float(follow(operator, origin.path))
    found: dict[type[AbstractOperator], float] = {}
    unseen: dict[type[AbstractOperator], float] = {}
    missed = _swing_error(result.held_out) if not result.swings_joined else 0.0
    for kind in _LAWS:
        if kind is type(operator) or (kind is MixedRAPI and amplitudes < _TELL_MIXED):
            continue
        ecdl, _ = guess_from(zero, kind, recording, operator.count, operator.coefficients.size, ())
        posed = Posed.of(ecdl, recording, None, weights, history=history, drift=drift)
        start = posed.problem.start(ecdl)
        end = posed.problem.solve(start, posed.weight, solver_options(max_steps))
        left = _rms(result, cut_to_runs(posed.problem, end.error))
        excess = max(left**2 - noise**2, 0.0)
        if excess < THRESHOLDS.law_share_left * (rmse**2 - noise**2):
            found[kind] = left
        elif missed > noise:
            kinds, options = ("swing",), solver_options(max_steps)
            held = cross_validate(posed.problem, posed.per_run, end, kinds, options=options)
            off = _swing_error(held)
            if off**2 - noise**2 < THRESHOLDS.law_share_left * (missed**2 - noise**2):
                unseen[kind] = off
    unit = recording.response_unit
    if unseen and not found:
        best = min(unseen, key=lambda kind: unseen[kind])
        law = _LAWS[best].format(unit=recording.drive_unit)
        return (
            f"{law} predict a swing that was left out better, to {quantity(unseen[best], unit)} "
            f"rms and not {quantity(missed, unit)}: "
            f"rapi fit RECORDING -o result --operator {best.__name__}"
        )
    if not found:
        return None
    best = min(found, key=lambda kind: found[kind])
    law = _LAWS[best].format(unit=recording.drive_unit)
    then, now = (quantity(size, unit) for size in (found[best], rmse))
    return (
        f"{law} describe these runs better, {then} rms from a first guess and not {now}: "
        f"rapi fit RECORDING -o result --operator {best.__name__}"
    )


def _swing_error(held_out: Sequence[HeldOut]) -> float:
    """The rms of errors on swings that were left out, each counted alike; 0 where none was."""
    errors = [h.rmse for h in held_out if h.scheme.startswith("swing")]
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else 0.0


def _noise(result: FitResult, errors: list[np.ndarray]) -> float:
    """The rms of what does not repeat under the errors of all runs."""
    found, count = [], []
    late = find_late_starts(result.recording.runs)
    for run, error, used in zip(result.recording.runs, errors, result.used, strict=True):
        index = np.flatnonzero(used)
        if run.name in late:
            index = index[after_first_period(run, index)]
        found.append(measure_run_noise(run, index, error[index])[0])
        count.append(index.size)
    return float(np.sqrt(np.average(np.square(found), weights=np.maximum(count, 1))))


def _rms(result: FitResult, errors: list[np.ndarray]) -> float:
    """The rms of errors over the samples that `result` was fitted to."""
    used = [error[use] for error, use in zip(errors, result.used, strict=True)]
    return float(np.sqrt(np.mean(np.concatenate(used) ** 2)))
