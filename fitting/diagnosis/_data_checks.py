"""Checks of arguments and data before a diagnosis, and faults of the data found by it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting.identification._options import default_free
from fitting.identification._parameter_vector import ParameterVector
from fitting.identification._posed import Posed
from fitting.identification.data_checks._data_checks import check_usable, find_faults
from fitting.identification.data_checks._fault import Fault, hides_effects
from fitting.identification.data_checks._thresholds import THRESHOLDS as CHECKS
from fitting.identification.data_checks.drives._drive_noise import find_swapped_columns
from fitting.identification.data_checks.holds._sweeps import single_sweep
from fitting.identification.data_checks.runs._exchanged_runs import find_copied_readings
from rapi_jax import ECDL, AbstractOperator, DataError, ModelError, Recording
from rapi_jax.effects import AbstractEffect

from ._thresholds import THRESHOLDS
from .refit._whitened_model import WhitenedModel

NOTHING_EXPLAINED = "nothing explained"
SINGLE_SWEEP = "single sweep"


def check_candidates(candidates: Any) -> None:
    """Raise `TypeError` where `candidates` holds something else than classes of effects."""
    for one in () if candidates is None else candidates:
        if not (isinstance(one, type) and issubclass(one, AbstractEffect)):
            raise TypeError(
                "Argument `candidates` must hold classes of effects, such as `effects.Creep`, but "
                f"holds {one!r}."
            )


def check_data(ecdl: ECDL | None, recording: Recording) -> None:
    """Raise `DataError` where readings, or the drive of a model to be identified, are constant.

    Also where a period at the rate that is stated holds hardly any sample.
    """
    check_usable(recording)
    for run in recording.runs:
        samples = 1.0 / (run.drive.rate * run.drive.step_s) if run.drive.repeats else np.inf
        if samples < CHECKS.least_period_samples:
            raise DataError(
                f"run {run.name!r} has {samples:.3g} samples a period at {run.drive.rate:g} Hz, "
                f"read every {run.drive.step_s:.3g} s. Is the clock in ms, or the rate in kHz? "
                "Write time in s and the rate in Hz."
            )
    if all(run.span == 0 for run in recording.runs):
        raise DataError(
            "the readings of all runs rest while the drive moves, so there is nothing to judge a "
            "model by. Check the sensor, its cable and the column, and record again."
        )
    if ecdl is None and all(run.drive.u_pp == 0 for run in recording.runs):
        raise DataError(
            "the drive of all runs rests, so no model can be identified. Check the generator and "
            "the column, or bring a model."
        )


def check_enough(whitened: WhitenedModel, operator: AbstractOperator) -> None:
    """Raise `DataError` where there are fewer samples a period than parameters."""
    alone = ECDL(operator)
    free = ParameterVector.of(alone).mask(alone, default_free(alone, whitened.recording)).sum()
    count = int(free) + whitened.initial_state_size(operator.count)
    phases = sum(int((block.use.sum(axis=0) > 0).sum()) for block in whitened.blocks)
    if phases < count:
        raise DataError(
            f"{phases} usable samples a period, of all runs together, cannot fix {count} "
            "parameters. Record more samples a period, or another rate or amplitude."
        )


def find_inconsistencies(
    recording: Recording, operator: AbstractOperator, *, explained: bool = False
) -> list[Fault]:
    """Drives and readings that do not belong together, which an effect must not explain.

    But for `LEFT_TO_EFFECTS`, which an effect may explain, too. `operator`: the base, from which
    all runs are fitted once more, without effects, where a change of some of them may explain much;
    not where it has `explained` them to within a measured noise: then they do belong together.
    """
    swapped = find_swapped_columns(recording)
    plain = find_faults(recording)
    if swapped or plain:  # a plain fault is said as it is
        return swapped or [fault for fault in plain if hides_effects(fault, recording)]
    sweep = single_sweep(recording)
    if sweep is not None:
        kind, _, text = sweep.partition(": ")
        return [Fault(kind, "", text)]
    if explained:
        return find_copied_readings(recording)
    model = ECDL(operator)
    try:
        posed = Posed.of(model, recording, None, "uniform", history=True, drift=None)
    except DataError:  # too few samples to tell
        return []
    return posed.suspicions(model, THRESHOLDS.consistency_steps)


def shown_faults(
    recording: Recording,
    errors: list[Float[np.ndarray, "_ _"]],
    whitened: WhitenedModel,
    named: tuple[str, ...],
    known: Sequence[Fault],
) -> list[Fault]:
    """Faults of the readings beside those `known`, and a model that does not explain them.

    `errors`: of the final model, "periods phases" a run. `named`: the effects named; saturation
    explains readings that are clipped.
    """
    found = [f for f in find_faults(recording) if f.kind != "clipped" or "saturation" not in named]
    told = {(fault.kind, fault.run) for fault in known}  # of fewer samples, where it is decimated
    found = [fault for fault in found if (fault.kind, fault.run) not in told]
    signal = [float(np.var(block.data[block.use > 0])) for block in whitened.blocks]
    used = [e[b.use > 0] for e, b in zip(errors, whitened.blocks, strict=True)]
    origin = [float(e.mean()) if whitened.own_origin else 0.0 for e in used]
    residual = [float(np.mean((e - o) ** 2)) for e, o in zip(used, origin, strict=True)]
    share = np.mean(residual) / max(float(np.mean(signal)), 1e-300)
    if share > 1.0 - THRESHOLDS.least_explained:
        text = (
            f"the model leaves {100 * share:.0f} % of the response's variance. The response does "
            "not follow this drive: check wiring, columns and lag."
        )
        found.append(Fault(NOTHING_EXPLAINED, "", text))
    return found


def check_units(about: dict[str, Any], recording: Recording) -> None:
    """Refuse a model of another unit."""
    for kind in ("response_unit", "drive_unit"):
        if about[kind] != getattr(recording, kind):
            raise ModelError(
                f"the model's {kind} is {about[kind]}, the recording's "
                f"{getattr(recording, kind)}. Bring a model identified in the same unit."
            )
