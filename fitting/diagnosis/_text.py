"""Sentences of the verdict: which effects, how probable, how much of the gap they close, advice."""

from collections.abc import Sequence
from typing import Any

from fitting._units import readable_unit
from fitting.report.diagnosis._text import describe_hypothesis, list_alternatives
from rapi_jax.effects import ALL, AbstractEffect

from ._thresholds import THRESHOLDS
from .which.evidence._thresholds import THRESHOLDS as SETS

Effects = Sequence[AbstractEffect | type[AbstractEffect]]


def sort_effects(effects: Effects) -> tuple[AbstractEffect | type[AbstractEffect], ...]:
    """Effects in the alphabetical order of their names, as hypotheses have them."""
    return tuple(sorted(effects, key=lambda effect: effect.name))


# What shows like these in a reading that is no optical frequency, and what to do about it.
_OF_A_SENSOR = {
    "etalon": (
        "a ripple periodic in the reading",
        "Look at the sensor's own ripple (interpolation, fringes). What only the sensor shows must "
        "not be compensated: leave it out (`--without etalon` of `rapi compensate`).",
    ),
    "mode_hop": (
        "jumps of the reading",
        "Look at the sensor's ranges and at contacts; leave the part with jumps out.",
    ),
    "drift": (
        "drift of the reading",
        "Let device and sensor settle, and repeat the zero before each scan. A period that does "
        "not close since the device was not cycled before looks the same: leave it out.",
    ),
    "current_coupling": (
        "a part that follows the drive at once",
        "Look at cross-talk of the drive into the sensor. What only the sensor shows must not be "
        "compensated: leave it out (`--without current_coupling` of `rapi compensate`).",
    ),
}


def effect_label(effect: AbstractEffect | type[AbstractEffect], unit: str) -> str:
    """What an effect is called in text; optical causes only where `unit` is a frequency."""
    return effect.label if unit == "GHz" else _OF_A_SENSOR.get(effect.name, (effect.label,))[0]


def effect_labels(effects: Effects, unit: str) -> dict[str, str]:
    """What effects are called in text, by their names."""
    return {effect.name: effect_label(effect, unit) for effect in effects}


def _remedy(effect: AbstractEffect | type[AbstractEffect], unit: str) -> str:
    return effect.remedy if unit == "GHz" else _OF_A_SENSOR.get(effect.name, (effect.remedy,))[-1]


def describe_effects(effects: Effects, unit: str = "GHz") -> str:
    """Effects by their labels: "creep of the piezo and drift of the optical frequency"."""
    labels = effect_labels(effects, unit)
    return describe_hypothesis("+".join(effect.name for effect in sort_effects(effects)), labels)


def verdict_sentence(
    name: str, effects: Effects, probability: float, shrinkage: dict[str, Any], unit: str
) -> str:
    """The verdict in one sentence."""
    sure = f"probability {min(probability, 0.99):.0%}".replace("%", " %")
    sure = sure if probability < 0.995 else "probability over 99 %"
    if name == "none":
        return f"No effect is missing: the residual of the model is noise ({sure})."
    if name == "unlisted":
        return f"The gap is real, but none of the known effects explains it ({sure})."
    what = describe_effects(effects, unit)
    closed = shrinkage.get("closed_fraction")
    alike = _held_out_alike(shrinkage, unit) if closed is None else ""
    # Else held-out data may be predicted no better.
    helps = not alike if closed is None else closed["low"] > 0.0
    verb = _verb(probability) if helps else "may be"
    if closed is None:
        return f"The gap {verb} {what} ({sure}).{alike}"
    sizes = shrinkage["before"], shrinkage["after"]
    shown, factor = readable_unit(unit, sizes)
    before, after = (f"{factor * size:.3g}" for size in sizes)
    if closed["value"] <= 0.0:
        return (
            f"The gap {verb} {what} ({sure}), but adding it to the model does not improve the "
            f"prediction of held-out data: {before} {shown} rms without it, {after} {shown} with "
            "it."
        )
    return (
        f"The gap {verb} {what} ({sure}). Added to the model, it closes {closed_share(closed)} of "
        f"the gap on held-out data: the residual falls from {before} to {after} {shown} rms."
    )


def _verb(probability: float) -> str:
    """How surely the gap is what it is called: "is" where nothing else is in the credible set."""
    if probability >= SETS.credible_level:
        return "is"
    return "is probably" if probability > THRESHOLDS.probable else "may be"


def _held_out_alike(shrinkage: dict[str, Any], unit: str) -> str:
    """What held-out data say of an effect without which they are predicted to noise."""
    known = [shrinkage.get(key) for key in ("before", "after", "floor")]
    if not shrinkage.get("held_out") or None in known:
        return ""
    sizes = float(shrinkage["before"]), float(shrinkage["after"])
    shown, factor = readable_unit(unit, sizes)
    before, after = (f"{factor * size:.3g}" for size in sizes)
    return (
        f" Held-out data do not show it: the model fitted without it leaves {before} {shown} rms "
        f"there, not significantly more than noise, and with it {after} {shown} rms."
    )


def closed_share(closed: dict[str, float]) -> str:
    """A share with its 95 % interval in percent: "94 % (90 to 96)"; below 0 the gap may grow.

    An interval that holds all of the gap and nothing of it says that nothing is known.
    """
    low, high = _percent(closed["low"]), _percent(min(closed["high"], 1.0))
    value = _percent(closed["value"])
    if low == value == high:
        return f"{value} %"
    if high == "over 99.9":
        return f"{value} % " + (f"(at least {low})" if closed["low"] > 0.0 else "(perhaps nothing)")
    return f"{value} % ({low} to {high})"


def _percent(share: float) -> str:
    """A share in percent, with a decimal where it is nearly all."""
    if share > 0.999:
        return "over 99.9"
    return f"{100.0 * share:.1f}" if share > 0.98 else f"{100.0 * share:.0f}"


def verdict_advice(
    name: str,
    effects: Effects,
    tied: list[str],
    scan: dict[str, Any] | None,
    *,
    unsure: bool = False,
    unit: str = "GHz",
    straighter: float | None = None,
    expected: float | None = None,
    plays: int | None = None,
) -> str:
    """What to do next, in one or two sentences.

    `tied`: names in the credible set. `unsure`: whether it holds `unlisted` beside one named
    hypothesis. `unit`: of the response. `straighter`: by what factor at most (97.5 %) a compensated
    scan is straighter with the effects than without; `expected`: by what factor it is predicted.
    `plays`: of the diagnosis' model, where that of the fit leaves more than noise for fewer plays.
    """
    if len(tied) > 1:
        labels = effect_labels((*ALL, *effects), unit)
        which = list_alternatives(tied, labels)
        if scan is not None and not scan["separates"]:
            return (
                f"These data cannot yet decide which effect it is: {which}. No scan "
                "within the limits is sure to decide it; the best of them is given below."
            )
        if scan is not None:
            return (
                f"These data cannot yet decide which effect it is: {which}. Record the next scan "
                "given below."
            )
        return (
            f"These data cannot decide which effect it is: {which}. The model predicts equally "
            "well with each of them, but none is established as the cause."
        )
    if name == "none":
        return (
            "Use the model as it is."
            if plays is None
            else (
                f"Use the model of this diagnosis, which has {plays} plays: they describe what the "
                "model of the fit leaves beyond noise."
            )
        )
    if name == "unlisted":
        then = " and record the next scan" if scan is not None else ""
        return (
            "Add none of the listed effects to the model. See where in the scan the gap "
            f"lies{then}. Further effects can be defined in a Python file and given by `--plugin`."
        )
    first = ""
    if unsure and scan is not None:
        first = "First record the next scan given below: a second effect may be missing. Then: "
    if straighter is not None and straighter < 1.0:
        return (
            f"{first}Do not compensate with this model: compensated scans would be less straight "
            "than with the model without the effect."
        )
    if expected is not None and expected < 1.0:
        return (
            f"{first}Do not compensate with this model yet: compensated scans are predicted to be "
            "less straight than with the model without the effect."
        )
    return first + " ".join(_remedy(effect, unit) for effect in sort_effects(effects))
