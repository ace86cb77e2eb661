"""Kinds of simulated devices, their effects and their mix."""

from . import _listed_drive as on_drive
from . import _listed_optical as on_light
from ._other_forms import FORMS
from ._recipe import Maker
from ._unlisted import UNLISTED
from .second._second_forms import MORE_FORMS
from .second._second_unlisted import MORE_UNLISTED
from .third._third_forms import UNSEEN_FORMS
from .third._third_unlisted import UNSEEN_UNLISTED

LISTED: dict[str, Maker] = {
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


EDITIONS: dict[int, dict[str, dict[str, Maker]]] = {
    1: {"form": FORMS, "unlisted": UNLISTED},
    2: {"form": MORE_FORMS, "unlisted": MORE_UNLISTED},
    3: {"form": UNSEEN_FORMS, "unlisted": UNSEEN_UNLISTED},
}
"""Other forms and unlisted effects by the number of their set.

Open banks hold the first. The second was unseen once and is for development now. The third is held
by sealed banks alone.
"""


def names_of(kind: str, *, edition: int = 1) -> list[str]:
    """The effects that a kind of device may be asked for, pairs joined by `+`.

    `edition`: of forms and unlisted effects, a key of `EDITIONS`; other kinds have the first alone.
    A form of a later one is called by its effect's name and the edition, `creep/2`, and the truth
    of its device is the name alone.
    """
    table = {
        "null": [""],
        "listed": sorted(LISTED),
        "pair": ["+".join(pair) for pair in pairs()],
    }
    kinds = ("null", "listed", "form", "pair", "unlisted")
    if kind not in kinds:
        raise ValueError(f"Argument `kind` must be one of {', '.join(kinds)}, but it is {kind!r}.")
    if edition not in EDITIONS:
        known = ", ".join(map(str, EDITIONS))
        raise ValueError(f"Argument `edition` must be one of {known}, but it is {edition!r}.")
    if kind in table:
        return table[kind] if edition == 1 else []
    return sorted(EDITIONS[edition][kind])


def makers(kind: str, effect: str) -> list[Maker]:
    """Makers of a device's effects. `effect` is a name of `names_of(kind)`, of any edition."""
    effect = effect.removeprefix("unlisted:")
    if not any(effect in names_of(kind, edition=edition) for edition in EDITIONS):
        raise ValueError(
            f"Argument `effect` must be one of {', '.join(names_of(kind))}, or one of a later "
            f"edition, for devices of kind {kind}, but it is {effect!r}."
        )
    if kind == "null":
        return []
    if kind in ("form", "unlisted"):
        return [next(of[kind][effect] for of in EDITIONS.values() if effect in of[kind])]
    return [LISTED[name] for name in effect.split("+")]
