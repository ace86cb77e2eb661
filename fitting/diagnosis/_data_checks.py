"""What a diagnosis refuses before it begins, and what of a recording it warns about."""

from typing import Any

import numpy as np

from fitting.identification._data_checks import Fault, check_usable, find_faults
from fitting.identification._fit import default_free
from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import ECDL, AbstractOperator, DataError, ModelError, Recording
from rapi_jax.effects import AbstractEffect

from .refit._whitened_model import WhitenedModel

_EXPLAINED = 0.5  # of the variance of the readings


def check_arguments(ecdl: Any, recording: Any, candidates: Any) -> None:
    """Raise `ValueError` where an argument of `diagnose` is of another kind."""
    if ecdl is not None and not isinstance(ecdl, ECDL):
        raise ValueError(
            f"Argument `ecdl` must be an ECDL or None, but is a {type(ecdl).__name__}. Wrap an "
            "operator: `ECDL(operator)`."
        )
    if not isinstance(recording, Recording):
        raise ValueError(
            f"Argument `recording` must be a Recording, but is a {type(recording).__name__}. "
            "Files are read by `rapi_jax.io.read_recording`."
        )
    for one in () if candidates is None else candidates:
        if not (isinstance(one, type) and issubclass(one, AbstractEffect)):
            raise ValueError(
                "Argument `candidates` must hold classes of effects, such as `effects.Creep`, but "
                f"holds {one!r}."
            )


def check_data(ecdl: ECDL | None, recording: Recording) -> None:
    """Raise `DataError` where a recording holds nothing that a model could be judged by."""
    check_usable(recording)
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
    """Raise `DataError` where there are fewer readings, by phase of the scan, than parameters."""
    alone = ECDL(operator)
    free = ParameterVector.of(alone).mask(alone, default_free(alone, whitened.recording)).sum()
    count = int(free) + whitened.initial_state_size(operator.count)
    phases = sum(int((block.use.sum(axis=0) > 0).sum()) for block in whitened.blocks)
    if phases < count:
        raise DataError(
            f"{phases} usable samples a period, of all runs together, cannot fix {count} "
            "parameters. Record more samples a period, or another rate or amplitude."
        )


def shown_faults(
    recording: Recording, left: list[np.ndarray], whitened: WhitenedModel, named: tuple[str, ...]
) -> list[Fault]:
    """Faults that show in the readings, and a model that explains none of them.

    `left`: errors of the final model. `named`: the effects named, which may excuse a fault.
    """
    found = [f for f in find_faults(recording) if f.kind != "clipped" or "saturation" not in named]
    moves = [float(np.var(block.data[block.use > 0])) for block in whitened.blocks]
    used = [e[b.use > 0] for e, b in zip(left, whitened.blocks, strict=True)]
    origin = [float(e.mean()) if whitened.own_origin else 0.0 for e in used]
    rest = [float(np.mean((e - o) ** 2)) for e, o in zip(used, origin, strict=True)]
    share = np.mean(rest) / max(float(np.mean(moves)), 1e-300)
    if share > 1.0 - _EXPLAINED:
        text = (
            f"the model leaves {100 * share:.0f} % of the response's variance. The response does "
            "not follow this drive: check wiring, columns and lag."
        )
        found.append(Fault("nothing explained", "", text))
    return found


def check_units(about: dict[str, Any], recording: Recording) -> None:
    """Refuse a model of another unit."""
    for kind in ("response_unit", "drive_unit"):
        if about[kind] != getattr(recording, kind):
            raise ModelError(
                f"the model's {kind} is {about[kind]}, the recording's "
                f"{getattr(recording, kind)}. Bring a model identified in the same unit."
            )
