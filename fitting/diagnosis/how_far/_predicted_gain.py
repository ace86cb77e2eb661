"""Predicted gain: how far the gap closes on scans not recorded, once the effects are modelled.

Held-out data say how far off the model may be: refits that lack a rate or an amplitude must reach
farther than the model will. The number of its parameters says how near noise lets it come. What is
foreseen lies between the two.
"""

from typing import NamedTuple

import numpy as np
from scipy.stats import chi2

from fitting.diagnosis.noise._periods import PeriodBlock
from fitting.diagnosis.noise._spectrum import Spectrum
from fitting.diagnosis.refit._gauss_newton import Refit, State
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.refit.estimates._estimates import effective_parameter_count
from fitting.diagnosis.where._gap import Gap, measure_gap
from rapi_jax import NotInvertible, certify
from rapi_jax.internal import refuse

from ._cross_validation import CrossValidation
from ._thresholds import THRESHOLDS

Range = dict[str, float]  # "value", "low", "high"


class PredictedGain(NamedTuple):
    """With 95 % intervals: the share of the gap that closes, and the factor of a scan.

    `run`: that whose scan stands for all; `nonlinearity`: rms that a drive without the effects
    leaves of it, in the response's unit. `linearity_gain`: by which that falls once the drive
    allows for the effects; `None` where no drive can.
    """

    closed: Range
    run: int
    nonlinearity: float
    linearity_gain: Range | None


class ErrorRange(NamedTuple):
    """Mean square by which a model will be off: least, likely, most."""

    low: float
    value: float
    high: float


def predict_gain(
    whitened: WhitenedModel,
    spectrum: Spectrum,
    none: State,
    top: tuple[Refit, State],
    held: CrossValidation | None,
) -> PredictedGain | None:
    """What becomes of scans like those recorded, from `none` to `top`.

    Without effects in the model the device is off by what the two models differ, and under the
    drive that linearises that model it is nonlinear by as much. What stays are errors of parameters
    and what of the gap still repeats with the scan; at most what stays open on data held out.
    `None` where noise is unknown, nothing repeats or nothing can be held out.
    """
    refit, state = top
    at = _reference_run(whitened)
    if at is None or held is None or held.closed is None or not spectrum.measured:
        return None
    blocks, own = whitened.blocks, whitened.own_origin
    count = effective_parameter_count(refit, state)
    left = measure_gap(state.errors.raw, blocks, spectrum, own_origin=own, fitted=round(count))
    off = [a - b for a, b in zip(none.errors.raw, state.errors.raw, strict=True)]
    before, bent = _power(off, blocks), nonlinearity_rms(off[at], blocks[at]) ** 2
    if not before > 0 or not bent > 0 or left.noise_floor is None:
        return None
    stays = _remaining_error(
        left, count / sum(float(b.use.sum()) for b in blocks), count, held, own
    )
    wide = THRESHOLDS.other_scan_factor**2
    least, likely, most = (min(max(x / before, THRESHOLDS.least_error), 1.0) for x in stays)
    # What held-out data leave open is a share of what was there to close on them.
    most = max(most, 1.0 - held.closed["low"], *(1.0 - x for x in _values(held)))
    closed = {"value": 1.0 - likely, "low": 1.0 - wide * most, "high": 1.0 - least / wide}
    if not _can_be_compensated(whitened, refit, state, at):
        return PredictedGain(closed, at, float(np.sqrt(bent)), None)
    low, value, high = (
        float(np.sqrt(bent / max(x, THRESHOLDS.least_error * bent))) for x in stays[::-1]
    )
    return PredictedGain(
        closed,
        at,
        float(np.sqrt(bent)),
        {
            "value": value,
            "low": low / THRESHOLDS.other_scan_factor,
            "high": high * THRESHOLDS.other_scan_factor,
        },
    )


def _can_be_compensated(whitened: WhitenedModel, refit: Refit, state: State, run: int) -> bool:
    """Whether a drive can be made from the model over the range of a run: whether it is monotone,
    and its effects are such that allow for it.
    """
    operator = whitened.set_values(refit.base.operator, state.values)
    drive = whitened.recording.runs[run].drive
    low, high = float(drive.value.min()), float(drive.value.max())
    try:
        refuse(state.effects)
        return certify(operator, low, high, drive.rate, u_pp=drive.u_pp).invertible
    except NotInvertible:
        return False


def _remaining_error(
    left: Gap, share: float, count: float, held: CrossValidation, own: bool
) -> ErrorRange:
    """From errors of parameters alone to what stays open on data held out; likely in between.

    `share`: parameters a reading.
    """
    error = (left.noise_floor or 0.0) ** 2 * share
    tails = chi2.ppf(
        [(1 - THRESHOLDS.level) / 2, (1 + THRESHOLDS.level) / 2], max(count, 1.0)
    ) / max(count, 1.0)
    margin = THRESHOLDS.structure_sigmas * left.synchronous_stderr
    least = error * float(tails[0])  # what is left may be of the runs recorded alone
    usual = error + max(left.synchronous, 0.0)
    most = error * float(tails[1]) + max(left.synchronous + margin, 0.0)
    closed = held.closed or {"value": 1.0, "low": 1.0}
    there = max(held.rms(own)[0] ** 2 - (left.noise_floor or 0.0) ** 2, 0.0)
    likely = max((1.0 - closed["value"]) * there, usual)
    return ErrorRange(
        least, float(np.sqrt(usual * likely)), max(most, (1.0 - closed["low"]) * there)
    )


def _values(held: CrossValidation) -> list[float]:
    """Closed fractions of the parts held out."""
    return [p["closed_fraction"]["value"] for p in held.parts if p["closed_fraction"]]


def _power(errors: list[np.ndarray], blocks: list[PeriodBlock]) -> float:
    """Mean square over all readings in use."""
    total = sum(float((b.use * e**2).sum()) for e, b in zip(errors, blocks, strict=True))
    return total / max(sum(float(b.use.sum()) for b in blocks), 1.0)


def nonlinearity_rms(signal: np.ndarray, block: PeriodBlock) -> float:
    """Rms of the mean period of `signal` about a line on each ramp, in the middle of its time."""
    mean, drive = signal.mean(axis=0), block.drive[0]
    turn = int(np.argmax(drive))
    ramps = [ramp for ramp in (np.arange(turn), np.arange(turn, mean.size)) if ramp.size > 4]
    squares = []
    for ramp in ramps:
        a, b = (int(share * ramp.size) for share in (THRESHOLDS.ramp_start, THRESHOLDS.ramp_end))
        inner = ramp[a : max(b, a + 3)]
        line = np.polyfit(inner, mean[inner], 1)
        squares.append(float(np.mean((mean[inner] - np.polyval(line, inner)) ** 2)))
    return float(np.sqrt(np.mean(squares)))


def _reference_run(whitened: WhitenedModel) -> int | None:
    """The run of the full swing whose rate is nearest to the middle; `None` where none repeats."""
    drives = whitened.recording.drives
    runs = [k for k, b in enumerate(whitened.blocks) if b.repeats]
    if not runs:
        return None
    widest = max(drives[k].u_pp for k in runs)
    full = sorted(
        (k for k in runs if drives[k].u_pp > THRESHOLDS.full_swing * widest),
        key=lambda k: drives[k].rate,
    )
    return full[len(full) // 2]
