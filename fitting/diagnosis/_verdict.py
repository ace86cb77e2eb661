"""The verdict: the most probable hypothesis, the reason for it, and what to do; notes besides."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

from fitting._units import quantity
from fitting.identification.data_checks._drive_character import describe_repetition
from fitting.identification.data_checks._fault import Fault
from fitting.identification.data_checks.holds._sweeps import describe_creep
from rapi_jax import Recording
from rapi_jax.effects import AbstractEffect, AbstractLawEffect

from ._data_checks import SINGLE_SWEEP
from ._diagnosis import Verdict
from ._text import (
    closed_share,
    describe_effects,
    effect_label,
    verdict_advice,
    verdict_sentence,
)
from ._thresholds import THRESHOLDS
from .family._choice import FamilyChoice
from .family._law import threshold_law
from .how_far._cross_validation import CrossValidation
from .next_scan._confirmation import needs_confirmation
from .next_scan._next_scan import NextScan
from .noise._residual_whiteness import ResidualWhiteness
from .noise._telegraph import RandomJumps
from .refit._whitened_model import WhitenedModel
from .which._base import FittedBase
from .which._candidate import Candidate
from .which._effect_sets import mechanism_name
from .which._excess import is_unexplained


def give_verdict(
    name: str,
    probability: float,
    credible: list[str],
    top: Candidate,
    none: Candidate,
    gap: dict[str, Any],
    shrinkage: dict[str, Any],
    next_scan: NextScan | None,
    recording: Recording,
    *,
    plays: int | None = None,
) -> Verdict:
    """The verdict on the most probable hypothesis; `plays`: see `verdict_advice`.

    `credible`: names of the credible set. `top`: the candidate of that name, `none` for `unlisted`.
    """
    effects = tuple(sorted(effect.name for effect in top.effects))
    tied = [n for n in credible if n not in ("none", "unlisted")]
    scan = None if next_scan is None else next_scan.to_dict()
    gain = shrinkage.get("straighter") or {}
    return Verdict(
        name=name,
        mechanism=mechanism_name(top.effects) if effects else name,
        effects=effects,
        probability=probability,
        set=tuple(credible),
        reason=_reason(none, top, gap["gap"]["sentence"], recording.response_unit),
        sentence=verdict_sentence(
            name, top.effects, probability, shrinkage, recording.response_unit
        ),
        advice=verdict_advice(
            name,
            top.effects,
            tied,
            scan,
            unsure=needs_confirmation(credible),
            unit=recording.response_unit,
            straighter=gain.get("high"),
            expected=gain.get("value"),
            plays=plays,
        ),
    )


def blame_data(verdict: Verdict, faults: list[Fault]) -> Verdict:
    """The verdict on data that do not belong together: the first fault in place of a cause."""
    sentence = f"The recording has a fault, so the device was not judged: {faults[0].message}"
    healthy = faults[0].kind == SINGLE_SWEEP
    advice = (
        "Diagnose that recording." if healthy else "Correct the recording, then diagnose it again."
    )
    return dataclasses.replace(verdict, sentence=sentence, advice=advice, judged=False)


def doubt_data(verdict: Verdict, faults: list[Fault]) -> Verdict:
    """The verdict where no effect explains data that have a fault: that comes first."""
    advice = (
        f"Correct the recording first, since its fault may be the cause: {faults[0].message} Then "
        "diagnose it again."
    )
    return dataclasses.replace(verdict, advice=advice)


def mention_likeliest(
    verdict: Verdict,
    ranked: Sequence[tuple[Candidate | None, float]],
    held_out: Mapping[str, CrossValidation],
    unit: str,
) -> Verdict:
    """The verdict with the likeliest of the known effects, where none of them is the answer.

    Only one of the credible set. `ranked`: hypotheses with their probabilities, likeliest first,
    `None` for `unlisted`. `held_out`: what is known of each on data held out.
    """
    likely = [(c, p) for c, p in ranked if c is not None and c.effects and c.name in verdict.set]
    if verdict.name != "unlisted" or not likely:
        return verdict
    first, probability = likely[0]
    found = held_out.get(first.name)
    closed = None if found is None else found.closed
    closes = f", which closes {closed_share(closed)} of the gap on held-out data" if closed else ""
    text = (
        f" Of the known ones the likeliest is {describe_effects(first.effects, unit)} "
        f"({100.0 * probability:.0f} %){closes}."
    )
    return dataclasses.replace(verdict, sentence=verdict.sentence + text)


def explain_richer_hysteresis(
    verdict: Verdict, richer: Mapping[str, Any], total: float, noise: float | None, unit: str
) -> Verdict:
    """The verdict that no effect is missing, where what the identified model leaves is no noise.

    A density of plays explains it. `richer`: `plays` of the diagnosis' model, and what it leaves,
    `rms`. `total`: what the identified model leaves; `noise` is part of both.
    """
    sure = verdict.sentence[verdict.sentence.rfind("(") :]
    alone, left = (quantity(size, unit) for size in (total, richer["rms"]))
    floor = "" if noise is None else f"; the noise is {quantity(noise, unit)} rms"
    sentence = (
        "No listed effect is missing: the gap is hysteresis of another shape than the identified "
        f"model has {sure} That model leaves {alone} rms, and the one of this diagnosis, with "
        f"{int(richer['plays'])} plays, {left} rms{floor}."
    )
    above = [max(size**2 - (noise or 0.0) ** 2, 0.0) for size in (total, richer["rms"])]
    advice = verdict.advice
    if above[1] > THRESHOLDS.still_open * above[0]:
        advice = (
            "Neither model follows this hysteresis to the noise: use the one of `rapi fit` within "
            "what it claims. More plays, or a value of `lam` for each, may leave less (`--plays`, "
            "`--each lam`)."
        )
    return dataclasses.replace(verdict, sentence=sentence, advice=advice)


def explain_random_jumps(
    verdict: Verdict, jumps: RandomJumps, synchronous: float, unit: str
) -> Verdict:
    """The verdict where what does not repeat with the scan moves by jumps.

    `synchronous`: rms of the gap that repeats with the scan. Where it is several times larger the
    verdict on it stays first, since the gap would hardly be smaller without the jumps.
    """
    size = f" of about {quantity(float(f'{jumps.size:.2g}'), unit)}" if jumps.size > 0 else ""
    where = "The part of the residual that does not repeat with the scan"
    optical = "mode competition, optical feedback, " if unit == "GHz" else ""
    switches = f"something that switches: {optical}a loose contact, a toggling bit of a converter."
    if jumps.size > 0 and synchronous > THRESHOLDS.larger_gap * jumps.size:
        sentence = (
            f"{verdict.sentence} {where}, a smaller one, consists of random jumps{size} (telegraph "
            "noise)."
        )
        advice = f"{verdict.advice} For the jumps, look for {switches}"
        return dataclasses.replace(verdict, sentence=sentence, advice=advice)
    sentence = (
        f"{where} consists of random jumps{size} (telegraph noise). No known effect jumps at "
        "random, and averaging does not remove such jumps."
    )
    advice = f"Look for {switches} Diagnose again once it is gone."
    return dataclasses.replace(verdict, sentence=sentence, advice=advice)


def doubt_noise(
    verdict: Verdict, left: ResidualWhiteness, unit: str, closed: dict[str, float] | None
) -> Verdict:
    """The verdict on a recording in which nothing repeats, so that no noise was measured.

    `left`: what the model leaves without any effect. `closed`: the closed fraction on data held
    out, where it is known: an effect is advised only where it predicts such data better.
    """
    if verdict.effects and (closed is None or closed["value"] <= 0.0):
        advice = (
            "Do not add the effect on the evidence of these data. Record at least three periods of "
            "one drive, and diagnose that recording."
        )
        return dataclasses.replace(verdict, advice=advice)
    size = (
        f"{left.rms:.3g} {unit} rms ({100 * left.rms / max(left.span, 1e-300):.2g} % of the span)"
    )
    if verdict.name == "none":
        sentence = (
            f"No effect is visible: the residual of the model, {size}, is consistent with noise. "
            "The noise itself was not measured, since no period is repeated."
        )
        advice = (
            "Use the model within the recorded range. Record at least three periods of one drive "
            "to measure the noise."
        )
    elif verdict.name == "unlisted" and left.doubts:
        sentence = (
            f"The residual of the model, {size}, does not look like noise: "
            f"{' and '.join(left.doubts)}. Without repeated periods, slow noise cannot be told "
            "from a missing effect."
        )
        advice = (
            "Add no effect to the model yet. Record at least three periods of one drive, at two "
            "rates if possible, and diagnose that recording."
        )
    else:
        return verdict
    return dataclasses.replace(verdict, sentence=sentence, advice=advice)


def _reason(none: Candidate, top: Candidate, sentence: str, unit: str) -> str:
    without = none.on_flexible_base
    lines = max(without.errors.synchronous.size, 1)
    text = "reduced chi-square of the scan-synchronous residual: "
    text += f"{without.synchronous / lines:.3g} without any effect"
    if top.effects:
        text += f", {top.on_flexible_base.synchronous / lines:.3g} with "
        text += describe_effects(top.effects, unit)
    return f"{text}. {sentence}".strip()


def collect_notes(
    whitened: WhitenedModel, fitted: FittedBase, top: Candidate, *, flexible: bool
) -> tuple[str, ...]:
    """What the recording cannot tell, and whether the model holds the flexible base."""
    recording, notes = whitened.recording, []
    notes += describe_creep(recording)
    if fitted.given is None and is_unexplained(fitted.state):
        notes.append(
            "The model was identified here, with the plays' shape shared, so that no play follows "
            "an effect: a fit in which plays have values of their own may leave less. `--model "
            "RESULT` judges that fit."
        )
    if not fitted.spectrum.measured:
        notes.append(
            "No run repeats a period, so noise was not measured but estimated from the highest "
            "frequencies: the gap is a lower bound, and the probabilities are less certain. "
            + (describe_repetition(recording) or "Record at least three periods.")
        )
    if recording.one_rate:
        which = "One scan rate" if recording.rates[0] > 0 else "No scan rate"
        notes.append(
            f"{which}: a lag cannot be distinguished reliably from rate-dependent thresholds, nor "
            "a tone or resonance near a multiple of the scan rate from hysteresis. Record two scan "
            "rates, at least a factor of two and better a factor of five apart."
        )
    if len(recording.amplitudes) == 1:
        notes.append(
            "One swing: a dependence on the swing cannot be seen, and drift cannot be told from "
            "creep. Record a second swing, half as large."
        )
    if top.has_other_form:
        cause = describe_effects(top.effects, recording.response_unit)
        notes.append(
            f"The cause is {cause}, in another form than the model's equation: other functions of "
            "the same mechanism explain what the equation leaves. The model holds the equation, "
            "which closes only its part of the gap."
        )
    if flexible:
        operator = top.on_flexible_operator[0].base.operator
        notes.append(
            "The identified hysteresis operator does not describe this device exactly, so the "
            f"model has a more flexible one with {operator.count} plays."
        )
    return tuple(notes)


def laws_of_hysteresis(
    family: FamilyChoice | None, classes: Sequence[type[AbstractEffect]]
) -> dict[str, type[AbstractEffect]]:
    """Laws of thresholds that may stand for the hysteresis itself, by name.

    None where its thresholds are the paper's: such a hysteresis may depend on amplitude and rate in
    other ways, too.
    """
    if family is None or not family.differs:
        return {}
    return {one.name: one for one in classes if issubclass(one, AbstractLawEffect)}


def describe_doubted_laws(
    laws: Mapping[str, type[AbstractEffect]], credible: Sequence[str], unit: str
) -> tuple[str, ...]:
    """A note where one of `laws` is among the credible answers, with what would decide."""
    named = {part for name in credible for part in name.split("+")} & laws.keys()
    labels = [effect_label(laws[name], unit) for name in sorted(named)]
    return tuple(
        f"{label[0].upper()}{label[1:]} may be the hysteresis itself here, since its thresholds "
        "are not the paper's: half of the probability was taken from it. Runs at more amplitudes "
        "and rates tell: a fit with other thresholds then leaves noise, or does not."
        for label in labels
    )


def describe_family(whitened: WhitenedModel, fitted: FittedBase) -> tuple[str, ...]:
    """A note where the thresholds follow another law than the paper's, with what to do."""
    if fitted.family is None:
        return ()
    if not fitted.family.differs:
        likelier = fitted.family.likelier
        if likelier is None:
            return ()
        return (
            f"{likelier} has more evidence than RA-PI's thresholds, but leaves most of the gap as "
            "well, so the cause was looked for with RA-PI's. Compare the two fits: "
            f"rapi fit RECORDING -o result --operator {likelier}",
        )
    unit = whitened.recording.drive_unit
    law = threshold_law(fitted.operator, max(d.u_pp for d in whitened.recording.drives), unit)
    command = f"rapi fit RECORDING -o result --operator {fitted.family.operator.__name__}"
    plays = fitted.operator.count
    command += "" if plays == 10 else f" --plays {plays}"
    if fitted.given is not None:
        return (f"{law} describe these runs better than the given model does: {command}",)
    return (
        f"{law} describe these runs better than thresholds proportional to the swing, as in RA-PI: "
        f"{command}",
    )
