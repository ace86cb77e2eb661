"""The verdict in words: what it is, how sure, how far it closes, what to do next."""

from typing import Any

from fitting.report.diagnosis._text import describe_hypothesis

_CURE = {
    "creep": "Compensate with the corrected model; let the device run in before a scan.",
    "resonance": "Compensate with the corrected model; round the corners of the scan.",
    "amplifier_lowpass": "Compensate with the corrected model, or use a faster amplifier.",
    "slew_limit": "Scan slower or less, or use an amplifier with more current.",
    "delay": "Set the latency of the reading (`response_lag_s`), or compensate with the model.",
    "saturation": "Scan less, or move the bias away from the amplifier's end.",
    "quantisation": "Use a source with more bits, or more of its range.",
    "rate_law": "Compensate with the corrected model.",
    "amplitude_law": "Compensate with the corrected model, at amplitudes that it has seen.",
    "drift": "Stabilise temperature and current; repeat the zero before each scan.",
    "gain_drift": "Stabilise temperature; identify again before a long session.",
    "mode_hop": "Scan less or move the bias, so that the hop lies outside.",
    "etalon": "Tilt or coat what reflects; the corrected model compensates what is left.",
    "pickup": "Find the source by its frequency: mains, pump, fan; shield or decouple.",
    "current_coupling": "Compensate with the corrected model; look at the current driver's ground.",
}


def verdict_sentence(
    name: str, effects: tuple[str, ...], probability: float, shrinkage: dict[str, Any], unit: str
) -> str:
    """The verdict in one sentence."""
    sure = f"probability {min(probability, 0.99):.0%}".replace("%", " %")
    sure = sure if probability < 0.995 else "probability over 99 %"
    if name == "none":
        return f"No effect is missing: what the model leaves is noise ({sure})."
    if name == "unlisted":
        return f"Something is missing that is none of the effects known ({sure})."
    what = describe_hypothesis("+".join(effects))
    closed = shrinkage.get("closed_fraction")
    if closed is None:
        return f"The gap is {what} ({sure})."
    low, high = _percent(max(closed["low"], 0.0)), _percent(min(closed["high"], 1.0))
    value = _percent(closed["value"])
    range_ = "" if low == value == high else f" ({low} to {high})"
    return (
        f"The gap is {what} ({sure}): with it the model closes {value}{range_} of the gap on data "
        "held out, from "
        f"{shrinkage['before']:.3g} to {shrinkage['after']:.3g} {unit} rms."
    )


def _percent(share: float) -> str:
    """A share in percent, with a decimal where it is nearly all."""
    if share > 0.999:
        return "over 99.9 %"
    text = f"{share:.1%}" if share > 0.98 else f"{share:.0%}"
    return text.replace("%", " %")


def verdict_advice(
    name: str,
    effects: tuple[str, ...],
    tied: list[str],
    scan: dict[str, Any] | None,
    *,
    unsure: bool = False,
) -> str:
    """What to do next, in one or two sentences.

    `unsure`: whether `unlisted` is in the set beside one answer alone.
    """
    if len(tied) > 1 and scan is not None:
        return f"{' and '.join(tied)} cannot be told apart yet: play the next scan below."
    if name == "none":
        return "Use the model as it is."
    if name == "unlisted":
        return (
            "Do not add an effect. Look at where the gap lies, and record the next scan; a new "
            "effect is one file."
        )
    first = ""
    if unsure and scan is not None:
        first = "Play the next scan below first: more may be missing. Then: "
    return first + " ".join(
        _CURE.get(effect, "Compensate with the corrected model.") for effect in effects
    )
