"""`diagnose`: where the sim-to-real gap lies, which effect causes it, how far it shrinks."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from rapi_jax import ECDL, DriveLimits, ModelError, Recording, effects
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import float64

from ._data_checks import check_arguments, check_data, shown_faults
from ._diagnosis import Diagnosis, Verdict
from ._text import describe_effects, verdict_advice, verdict_sentence
from .how_far._cross_validation import CrossValidation, cross_validate
from .how_far._explainable_fraction import explainable_fraction
from .how_far._predicted_gain import predict_gain
from .next_scan._choice import Hypothesis, NextScan, choose_next_scan
from .next_scan._confirmation import confirmation_scan, needs_confirmation
from .noise._periods import decimate
from .refit._estimates import estimate_effects
from .refit._gauss_newton import Refit, State
from .refit._whitened_model import WhitenedModel
from .where._gap import measure_gap, split_gap
from .where._localisation import describe_localisation, localise
from .where._residual_profiles import residual_profiles
from .which._base import FittedBase, fit_base
from .which._calibration import load_calibration
from .which._candidate import Candidate
from .which._evidence import Evidence
from .which._excess import is_unexplained
from .which._forward_selection import Attribution, select_effects
from .which._probability import UNLISTED, Ranked, credible_set, hypothesis_probabilities

Progress = Callable[[str], None]
_SHOWN = 1e-6  # hypotheses less probable are not listed
_RIVALS = 3


@float64
@np.errstate(over="ignore", invalid="ignore")  # a refit that runs away has no finite cost
def diagnose(
    ecdl: ECDL | None,
    recording: Recording,
    *,
    candidates: Sequence[type[AbstractEffect]] | None = None,
    limits: DriveLimits | None = None,
    scan: bool = True,
    progress: Progress | None = None,
) -> Diagnosis:
    """Where `recording` departs from a model, which effect explains it, how far the gap closes.

    **Arguments:**

    - `ecdl`: the model brought along, which tells a wrong parameter from a missing effect; `None`:
      identify one first.
    - `candidates`: classes of effects to consider; `effects.ALL` by default.
    - `limits`: of the next scan; by default the recording's own range, see `next_scan`.
    - `scan`: whether to look for the next scan.
    - `progress`: called with a line before each step.

    **Returns** a `Diagnosis`. Raises `DataError` where the recording holds nothing to judge by
    (readings that rest, no complete period, fewer samples than parameters), and `ValueError` for
    arguments of another kind.
    """
    began = time.perf_counter()
    say = progress or (lambda line: None)
    check_arguments(ecdl, recording, candidates)
    check_data(ecdl, recording)
    whitened = WhitenedModel.of(decimate(recording))
    say("base model")
    fitted = fit_base(whitened, ecdl)
    chosen = effects.ALL if candidates is None else tuple(dict.fromkeys(candidates))
    attribution = select_effects(fitted, chosen, say)
    evidence = Evidence.of(attribution, noise_known=fitted.spectrum.measured)
    ranked = _named(attribution, hypothesis_probabilities(evidence))
    rich = _needs_rich(ranked[0][0] or attribution.none)
    say("held-out data")
    credits = _credits(whitened, fitted, attribution, ranked, rich, say)
    closed = {name: held.closed["value"] for name, held in credits.items() if held.closed}
    posterior = hypothesis_probabilities(evidence, closed)
    ranked = _named(attribution, posterior)
    names = credible_set(posterior)
    best = ranked[0][0]
    name, probability = posterior[0]
    top = attribution.none if best is None else best
    held = credits.get(name)
    content = _content(whitened, fitted, attribution, ranked, credits, top, held)
    content["evidence"] = evidence.to_dict()
    following = None
    if scan:
        say("next scan")
        following = _next_scan(whitened, fitted, ranked, names, limits)
        content["next_scan"] = None if following is None else following.to_dict()
    refit, state = _of(top, fitted.refit, rich)
    model = state.to_ecdl(whitened, refit.base)
    without, bare = _of(attribution.none, fitted.refit, rich)
    base = bare.to_ecdl(whitened, without.base)
    tied = [n for n in names if n not in ("none", "unlisted")]
    words = tuple(sorted(effect.name for effect in top.effects))
    verdict = Verdict(
        name,
        words,
        probability,
        tuple(names),
        _reason(attribution, top, content),
        verdict_sentence(
            name, top.effects, probability, content["shrinkage"], recording.response_unit
        ),
        verdict_advice(
            name, top.effects, tied, content.get("next_scan"), unsure=needs_confirmation(names)
        ),
    )
    content["model"] = {
        "operator": type(model.operator).__name__,
        "effects": [type(effect).__name__ for effect in model.effects],
        "plays": model.operator.count,
        "file": "model.rapi",
    }
    wrong = shown_faults(recording, state.errors.raw, whitened, words)
    content["faults"] = [dataclasses.asdict(fault) for fault in wrong]
    notes = tuple(f"{fault.kind}: {fault.message}" for fault in wrong)
    notes += _notes(whitened, fitted, top, rich)
    seconds = time.perf_counter() - began
    labels = {cls.name: cls.label for cls in chosen}
    drive = None if following is None else following.drive
    return Diagnosis(recording, model, base, verdict, content, notes, seconds, drive, labels)


def _named(attribution: Attribution, ranked: Ranked) -> list[tuple[Candidate | None, float]]:
    """The candidates behind the names; `None` stands for `unlisted`."""
    known: dict[str, Candidate | None] = {UNLISTED: None}
    known |= {c.name: c for c in (attribution.none, *attribution.candidates)}
    return [(known[name], probability) for name, probability in ranked]


def _needs_rich(top: Candidate) -> bool:
    """Whether the identified operator, unlike the richer one, leaves more than noise."""
    own = top.on_base.synchronous - top.on_base.errors.synchronous.size
    rich = top.on_flexible_base.synchronous - top.on_flexible_base.errors.synchronous.size
    return is_unexplained(top.on_base) and own > 1.5 * max(rich, 0.0)


def _of(candidate: Candidate, refit: Refit, rich: bool) -> tuple[Refit, State]:
    return (
        (candidate.flexible_refit, candidate.on_flexible_base)
        if rich
        else (refit, candidate.on_base)
    )


def _credits(
    whitened: WhitenedModel,
    fitted: FittedBase,
    attribution: Attribution,
    ranked: list[tuple[Candidate | None, float]],
    rich: bool,
    say: Progress,
) -> dict[str, CrossValidation]:
    """Held-out credit of the likeliest effects, on one base for all."""
    none = _of(attribution.none, fitted.refit, rich)
    likely = [c for c, p in ranked if c is not None and c.effects and p > 0.02][:2]
    if not likely and attribution.candidates:
        likely = [attribution.best]
    pairs = [_of(candidate, fitted.refit, rich) for candidate in likely]
    found = cross_validate(whitened, none, pairs, say)
    return {c.name: held for c, held in zip(likely, found, strict=True) if held is not None}


def _content(
    whitened: WhitenedModel,
    fitted: FittedBase,
    attribution: Attribution,
    ranked: list[tuple[Candidate | None, float]],
    credits: dict[str, CrossValidation],
    top: Candidate,
    held: CrossValidation | None,
) -> dict[str, Any]:
    recording, blocks, spectrum = whitened.recording, whitened.blocks, fitted.spectrum
    own = whitened.own_origin
    # What the refitted base leaves is looked at before any effect is added.
    raw = attribution.none.on_base.errors.raw
    fitted_count = int(fitted.refit.base.free.sum())
    whole = measure_gap(raw, blocks, spectrum, own_origin=own, fitted=fitted_count)
    total = None
    if fitted.given is not None:
        total = measure_gap(fitted.given, blocks, spectrum, own_origin=own).total
    parts = split_gap(total, whole.total, whole.noise_floor)
    shown = fitted.given if fitted.given is not None else raw
    entries = localise(shown, blocks, spectrum, recording, own_origin=own)
    pictures = residual_profiles(shown, blocks, spectrum, recording, own_origin=own)
    floor = parts["noise_floor"]
    before, after = held.rms(own) if held else (whole.total, whole.total)
    left = localise(top.on_flexible_base.errors.raw, blocks, spectrum, recording, own_origin=own)
    rich = _needs_rich(top)
    refit, state = _of(top, fitted.refit, rich)
    bare = _of(attribution.none, fitted.refit, rich)[1]
    promise = predict_gain(whitened, spectrum, bare, (refit, state), held)
    shrinkage = {
        "before": before,
        "after": after,
        "floor": floor,
        "closed_fraction": held.closed if held else None,
        "held_out": [p["part"] for p in held.parts] if held else [],
        "by_part": held.parts if held else [],
        "foreseen": None if promise is None else promise.closed,
        "straighter": None if promise is None else promise.straighter,
        "ceiling": explainable_fraction(raw, blocks, spectrum, own_origin=own),
        "remainder": describe_localisation(left),
    }
    return {
        "recording": _recording(whitened),
        "gap": parts
        | {
            "locked": _root(whole.synchronous),
            "not_locked": _root(whole.nonsynchronous),
            "significant": whole.significant and parts["structural"] != 0,
            "sentence": describe_localisation(entries, pictures),
        },
        "where": entries,
        "maps": pictures,
        "hypotheses": _hypotheses(whitened, fitted, attribution, ranked, credits),
        "shrinkage": shrinkage,
        "next_scan": None,
        "calibration": {"bank": load_calibration().provenance},
    }


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


def _recording(whitened: WhitenedModel) -> dict[str, Any]:
    recording = whitened.recording
    return {
        "runs": len(recording.runs),
        "samples": int(sum(d.size for d in recording.drives)),
        "rates_hz": recording.rates,
        "amplitudes": recording.amplitudes,
        "periods": [b.periods for b in whitened.blocks],
        "drive_unit": recording.drive_unit,
    }


def _hypotheses(
    whitened: WhitenedModel,
    fitted: FittedBase,
    attribution: Attribution,
    ranked: list[tuple[Candidate | None, float]],
    credits: dict[str, CrossValidation],
) -> list[dict[str, Any]]:
    out: list[dict[str, Any]] = []
    recording = whitened.recording
    for candidate, probability in ranked:
        if candidate is None:
            out.append({"effects": [], "name": "unlisted", "probability": probability})
            continue
        entry: dict[str, Any] = {
            "effects": sorted(effect.name for effect in candidate.effects),
            "name": candidate.name,
            "probability": probability,
        }
        if candidate.effects:
            refit, state = _of(candidate, fitted.refit, _needs_rich(candidate))
            credit_ = credits.get(candidate.name)
            entry |= {
                "survival": candidate.unabsorbed_fraction,
                "parameters": estimate_effects(
                    refit, state, recording.response_unit, recording.drive_unit
                ),
                "closed_fraction": credit_.closed if credit_ else None,
                "delta_chi2": attribution.none.cost - candidate.cost,
                "sentence": describe_effects(candidate.effects),
            }
        out.append(entry)
    return out


def _next_scan(
    whitened: WhitenedModel,
    fitted: FittedBase,
    ranked: list[tuple[Candidate | None, float]],
    names: list[str],
    limits: DriveLimits | None,
) -> NextScan | None:
    """The scan that separates the likeliest hypotheses; the best two where one stands alone.

    Where one stands beside `unlisted`, the scan that shows whether it is all.
    """
    if needs_confirmation(names):
        return confirmation_scan(whitened, names, limits)
    named = [(c, p) for c, p in ranked if c is not None][:_RIVALS]
    tied = [(c, p) for c, p in named if p > 0.02]
    rivals = tied if len(tied) > 1 else named[:2]
    if len(rivals) < 2:
        return None
    hypotheses = [
        Hypothesis(c.name, c.on_base.effects, np.asarray(c.on_base.values), p) for c, p in rivals
    ]
    return choose_next_scan(whitened, fitted.whitener, fitted.refit.base, hypotheses, limits)


def _reason(attribution: Attribution, top: Candidate, content: dict[str, Any]) -> str:
    none = attribution.none.on_flexible_base
    lines = max(none.errors.synchronous.size, 1)
    text = f"chi-square a line: {none.synchronous / lines:.3g} without any effect"
    if top.effects:
        text += f", {top.on_flexible_base.synchronous / lines:.3g} with {top.name}"
    return f"{text}. {content['gap']['sentence']}".strip()


def _notes(
    whitened: WhitenedModel, fitted: FittedBase, top: Candidate, rich: bool
) -> tuple[str, ...]:
    recording, notes = whitened.recording, []
    if not fitted.spectrum.measured:
        notes.append(
            "No run repeats, so noise is not measured but read off the fastest lines: the gap is a "
            "lower edge, and probabilities are wide. Record three periods or more."
        )
    if len(recording.rates) == 1:
        notes.append("One scan rate: a lag cannot be told from rate-dependent thresholds for sure.")
    if len(recording.amplitudes) == 1:
        notes.append(
            "One amplitude: an amplitude law cannot show, nor can drift be told from creep."
        )
    if rich:
        notes.append(
            "The identified operator is not quite the device's: the model holds the richer one of "
            f"{top.flexible_refit.base.operator.count} plays."
        )
    return tuple(notes)


def check_units(about: dict[str, Any], recording: Recording) -> None:
    """Refuse a model of another unit."""
    for kind in ("response_unit", "drive_unit"):
        if about[kind] != getattr(recording, kind):
            raise ModelError(
                f"the model's {kind} is {about[kind]}, the recording's "
                f"{getattr(recording, kind)}. Bring a model identified in the same unit."
            )
