"""Why nothing is claimed of how straight the device will scan, and effects that were left out."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fitting._units import quantity
from rapi_jax import ECDL, Run, linearity, predict
from rapi_jax.effects import AbstractEffect


def why_unclaimed(
    about: dict[str, Any], left_out: Sequence[str], *, diagnosed: bool, beyond: bool
) -> str | None:
    """The reason in words that follow a colon, with what would change it; `None` where it is not.

    `about`: the model's header. `left_out`: names of effects that were not inverted. `diagnosed`:
    whether the model comes from a diagnosis. `beyond`: whether a drive goes beyond what the model
    was identified on.
    """
    if left_out:
        return (
            f"{_were(left_out)} left out of the model that was inverted, and a reading that has it "
            "still shows it (by how much is in the notes of the certificate)"
        )
    if not about.get("trusted", False):
        return "the model is not to be trusted. A fit that is trusted makes a claim"
    if about.get("claim") is None:
        if diagnosed:
            return (
                "the model comes from a diagnosis, which makes no claim of runs that it has not "
                "seen. A trusted `rapi fit` of two runs or more makes one"
            )
        return (
            "the model carries no claim, as no run was left out of its fit. A trusted `rapi fit` "
            "of two runs or more makes one"
        )
    if beyond:
        return (
            "a drive goes beyond what the model was identified on (see the notes). Record runs "
            "like it, and fit again"
        )
    return None


def left_out_notes(
    drives: Sequence[dict[str, float]], left_out: Sequence[str], unit: str
) -> list[str]:
    """A note on the effects that the drives do not compensate, by the `drives`' rms in readings."""
    if not left_out:
        return []
    most = max(max(one.values()) for one in drives)
    return [
        f"{_were(left_out)} left out of the model that was inverted (`--without`), so the drives "
        "do not compensate this. A reading that has it still shows it: by the model up to "
        f"{quantity(most, unit)} rms off a straight line."
    ]


def reading_notes(effects: Sequence[AbstractEffect], unit: str) -> list[str]:
    """A note for each effect that these drives compensate and that the reading alone may have.

    Where the response is no optical frequency (`unit`), the reading may always be what shows it.
    """
    found = {effect.name: effect.in_reading_alone for effect in effects}
    return [
        f"the drives compensate the effect {name}, too. Where only the reading has it"
        f"{f' ({when})' if unit == 'GHz' else ''}, they would put it on the device: write them "
        f"again with `--without {name}`."
        for name, when in found.items()
        if when
    ]


def reading_nonlinearity(made: Any, used: ECDL, whole: ECDL) -> dict[str, float]:
    """How far off straight lines (rms), up and down, `whole` lets the reading of a scan be.

    `made`: a compensation by `used`, the model without the effects that were left out.
    """
    added = np.asarray(predict(whole, made.drive)) - np.asarray(predict(used, made.drive))
    straight = made.target.value if made.predicted is None else made.predicted
    up, down = linearity(Run(made.drive, straight + added)).rms_ghz
    return {"up": up, "down": down}


def _were(names: Sequence[str]) -> str:
    if len(names) == 1:
        return f"the effect {names[0]} was"
    return f"the effects {' and '.join(names)} were"
