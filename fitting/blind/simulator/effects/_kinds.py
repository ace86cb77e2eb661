"""Kinds of simulated devices, their effects and their mix."""

from collections.abc import Callable

import numpy as np

from . import _listed_drive as on_drive
from . import _listed_optical as on_light
from ._other_forms import FORMS
from ._recipe import Recipe, Setting
from ._second_forms import MORE_FORMS
from ._second_unlisted import MORE_UNLISTED
from ._unlisted import UNLISTED

LISTED: dict[str, Callable[[np.random.Generator, Setting], Recipe]] = {
    "amplifier_lowpass": on_drive.amplifier_lowpass,
    "amplitude_law": on_drive.amplitude_law,
    "creep": on_light.creep,
    "current_coupling": on_light.current_coupling,
    "delay": on_drive.delay,
    "drift": on_light.drift,
    "etalon": on_light.etalon,
    "gain_drift": on_light.gain_drift,
    "mode_hop": on_light.mode_hop,
    "pickup": on_light.pickup,
    "quantisation": on_drive.quantisation,
    "rate_law": on_drive.rate_law,
    "resonance": on_light.resonance,
    "saturation": on_drive.saturation,
    "slew_limit": on_drive.slew_limit,
}

MIX = {"null": 0.22, "listed": 0.30, "form": 0.12, "pair": 0.13, "unlisted": 0.23}
"""Parts of a bank. Nulls are half with base misfit, and so are the others."""

SIGMA = (0.5, 20.0)
"""Sizes asked for, uniform in the logarithm, in multiples of the noise."""


def pairs() -> list[tuple[str, str]]:
    """All pairs of listed effects in alphabetical order."""
    names = sorted(LISTED)
    return [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]


def names_of(kind: str, *, unseen: bool = False) -> list[str]:
    """The effects that a kind of device may be asked for, pairs joined by `+`.

    `unseen`: instead those that no open bank and no calibration holds. Such a form is called by
    its effect's name and `/2`, and the truth of its device is the name alone.
    """
    table = {
        "null": [""],
        "listed": sorted(LISTED),
        "form": sorted(FORMS),
        "pair": ["+".join(pair) for pair in pairs()],
        "unlisted": sorted(UNLISTED),
    }
    if kind not in table:
        raise ValueError(f"Argument `kind` must be one of {', '.join(table)}, but it is {kind!r}.")
    if unseen:
        return sorted({"form": MORE_FORMS, "unlisted": MORE_UNLISTED}.get(kind, {}))
    return table[kind]


def makers(kind: str, effect: str) -> list[Callable[[np.random.Generator, Setting], Recipe]]:
    """Makers of a device's effects. `effect` is a name of `names_of(kind)`, or an unseen one."""
    effect = effect.removeprefix("unlisted:")
    if effect not in (*names_of(kind), *names_of(kind, unseen=True)):
        raise ValueError(
            f"Argument `effect` must be one of {', '.join(names_of(kind))}, or one of those "
            f"that no open bank holds, for devices of kind {kind}, but it is {effect!r}."
        )
    if kind == "null":
        return []
    if kind == "form":
        return [(FORMS | MORE_FORMS)[effect]]
    if kind == "unlisted":
        return [(UNLISTED | MORE_UNLISTED)[effect]]
    return [LISTED[name] for name in effect.split("+")]
