"""`diagnose`: where the sim-to-real gap lies, which effect causes it, how far it shrinks."""

import dataclasses
import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from fitting.report.diagnosis._text import said
from rapi_jax import ECDL, DriveLimits, ModelError, Recording, effects
from rapi_jax._precision import float64
from rapi_jax.effects import AbstractEffect

from ._data_checks import check_arguments, check_data, shown_faults
from ._diagnosis import Diagnosis, Verdict
from ._text import advice, sentence
from .how_far._cross_validation import Held, credits_of
from .how_far._explainable_fraction import ceiling
from .how_far._predicted_gain import foreseen
from .next_scan._choice import Hypothesis, NextScan, next_scan
from .next_scan._confirmation import is_alone, scan_inside
from .noise._periods import thinned
from .refit._estimates import estimates
from .refit._gauss_newton import Refit, State
from .refit._whitened_model import Engine
from .where._gap import gap, parametric
from .where._localisation import summary, where
from .where._residual_profiles import maps
from .which._base import Fitted, fitted_base
from .which._calibration import shipped
from .which._candidates import Candidate
from .which._evidence import Evidence
from .which._forward_selection import Attribution, attribute, unexplained
from .which._probability import UNLISTED, Ranked, probabilities, smallest_set

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
    engine = Engine.of(thinned(recording))
    say("base model")
    fitted = fitted_base(engine, ecdl)
    chosen = effects.ALL if candidates is None else tuple(dict.fromkeys(candidates))
    attribution = attribute(fitted, chosen, say)
    evidence = Evidence.of(attribution, noise_known=fitted.spectrum.known)
    ranked = _named(attribution, probabilities(evidence))
    rich = _needs_rich(ranked[0][0] or attribution.none)
    say("held-out data")
    credits = _credits(engine, fitted, attribution, ranked, rich, say)
    closed = {name: held.closed["value"] for name, held in credits.items() if held.closed}
    said = probabilities(evidence, closed)
    ranked = _named(attribution, said)
    names = smallest_set(said)
    best = ranked[0][0]
    name, probability = said[0]
    top = attribution.none if best is None else best
    held = credits.get(name)
    content = _content(engine, fitted, attribution, ranked, credits, top, held)
    content["evidence"] = evidence.to_dict()
    following = None
    if scan:
        say("next scan")
        following = _next_scan(engine, fitted, ranked, names, limits)
        content["next_scan"] = None if following is None else following.to_dict()
    refit, state = _of(top, fitted.refit, rich)
    model = state.ecdl(engine, refit.base)
    without, bare = _of(attribution.none, fitted.refit, rich)
    base = bare.ecdl(engine, without.base)
    tied = [n for n in names if n not in ("none", "unlisted")]
    words = tuple(sorted(effect.name for effect in top.effects))
    verdict = Verdict(
        name,
        words,
        probability,
        tuple(names),
        _reason(attribution, top, content),
        sentence(name, words, probability, content["shrinkage"], recording.response_unit),
        advice(name, words, tied, content.get("next_scan"), unsure=is_alone(names)),
    )
    content["model"] = {
        "operator": type(model.operator).__name__,
        "effects": [type(effect).__name__ for effect in model.effects],
        "plays": model.operator.count,
        "file": "model.rapi",
    }
    wrong = shown_faults(recording, state.errors.raw, engine, words)
    content["faults"] = [dataclasses.asdict(fault) for fault in wrong]
    notes = tuple(f"{fault.kind}: {fault.message}" for fault in wrong)
    notes += _notes(engine, fitted, top, rich)
    seconds = time.perf_counter() - began
    drive = None if following is None else following.drive
    return Diagnosis(recording, model, base, verdict, content, notes, seconds, drive)


def _named(attribution: Attribution, ranked: Ranked) -> list[tuple[Candidate | None, float]]:
    """The candidates behind the names; `None` stands for `unlisted`."""
    known: dict[str, Candidate | None] = {UNLISTED: None}
    known |= {c.name: c for c in (attribution.none, *attribution.candidates)}
    return [(known[name], probability) for name, probability in ranked]


def _needs_rich(top: Candidate) -> bool:
    """Whether the identified operator, unlike the richer one, leaves more than noise."""
    own = top.plain.locked - top.plain.errors.locked.size
    rich = top.rich.locked - top.rich.errors.locked.size
    return unexplained(top.plain) and own > 1.5 * max(rich, 0.0)


def _of(candidate: Candidate, refit: Refit, rich: bool) -> tuple[Refit, State]:
    return (candidate.rich_refit, candidate.rich) if rich else (refit, candidate.plain)


def _credits(
    engine: Engine,
    fitted: Fitted,
    attribution: Attribution,
    ranked: list[tuple[Candidate | None, float]],
    rich: bool,
    say: Progress,
) -> dict[str, Held]:
    """Held-out credit of the likeliest effects, on one base for all."""
    none = _of(attribution.none, fitted.refit, rich)
    likely = [c for c, p in ranked if c is not None and c.effects and p > 0.02][:2]
    if not likely and attribution.candidates:
        likely = [attribution.best]
    pairs = [_of(candidate, fitted.refit, rich) for candidate in likely]
    found = credits_of(engine, none, pairs, say)
    return {c.name: held for c, held in zip(likely, found, strict=True) if held is not None}


def _content(
    engine: Engine,
    fitted: Fitted,
    attribution: Attribution,
    ranked: list[tuple[Candidate | None, float]],
    credits: dict[str, Held],
    top: Candidate,
    held: Held | None,
) -> dict[str, Any]:
    recording, blocks, spectrum = engine.recording, engine.blocks, fitted.spectrum
    own = engine.own_origin
    # What the refitted base leaves is looked at before any effect is added.
    raw = attribution.none.plain.errors.raw
    fitted_count = int(fitted.refit.base.free.sum())
    whole = gap(raw, blocks, spectrum, own_origin=own, fitted=fitted_count)
    total = None
    if fitted.given is not None:
        total = gap(fitted.given, blocks, spectrum, own_origin=own).total
    parts = parametric(total, whole.total, whole.noise_floor)
    shown = fitted.given if fitted.given is not None else raw
    entries = where(shown, blocks, spectrum, recording, own_origin=own)
    pictures = maps(shown, blocks, spectrum, recording, own_origin=own)
    floor = parts["noise_floor"]
    before, after = held.rms(own) if held else (whole.total, whole.total)
    left = where(top.rich.errors.raw, blocks, spectrum, recording, own_origin=own)
    rich = _needs_rich(top)
    refit, state = _of(top, fitted.refit, rich)
    bare = _of(attribution.none, fitted.refit, rich)[1]
    promise = foreseen(engine, spectrum, bare, (refit, state), held)
    shrinkage = {
        "before": before,
        "after": after,
        "floor": floor,
        "closed_fraction": held.closed if held else None,
        "held_out": [p["part"] for p in held.parts] if held else [],
        "by_part": held.parts if held else [],
        "foreseen": None if promise is None else promise.closed,
        "straighter": None if promise is None else promise.straighter,
        "ceiling": ceiling(raw, blocks, spectrum, own_origin=own),
        "remainder": summary(left),
    }
    return {
        "recording": _recording(engine),
        "gap": parts
        | {
            "locked": _root(whole.locked),
            "not_locked": _root(whole.not_locked),
            "significant": whole.significant and parts["structural"] != 0,
            "sentence": summary(entries, pictures),
        },
        "where": entries,
        "maps": pictures,
        "hypotheses": _hypotheses(engine, fitted, attribution, ranked, credits),
        "shrinkage": shrinkage,
        "next_scan": None,
        "calibration": {"bank": shipped().provenance},
    }


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))


def _recording(engine: Engine) -> dict[str, Any]:
    recording = engine.recording
    return {
        "runs": len(recording.runs),
        "samples": int(sum(d.size for d in recording.drives)),
        "rates_hz": recording.rates,
        "amplitudes": recording.amplitudes,
        "periods": [b.periods for b in engine.blocks],
        "drive_unit": recording.drive_unit,
    }


def _hypotheses(
    engine: Engine,
    fitted: Fitted,
    attribution: Attribution,
    ranked: list[tuple[Candidate | None, float]],
    credits: dict[str, Held],
) -> list[dict[str, Any]]:
    out: list[dict[str, Any]] = []
    recording = engine.recording
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
                "survival": candidate.survival,
                "parameters": estimates(
                    refit, state, recording.response_unit, recording.drive_unit
                ),
                "closed_fraction": credit_.closed if credit_ else None,
                "delta_chi2": attribution.none.cost - candidate.cost,
                "sentence": said(candidate.name),
            }
        out.append(entry)
    return out


def _next_scan(
    engine: Engine,
    fitted: Fitted,
    ranked: list[tuple[Candidate | None, float]],
    names: list[str],
    limits: DriveLimits | None,
) -> NextScan | None:
    """The scan that separates the likeliest hypotheses; the best two where one stands alone.

    Where one stands beside `unlisted`, the scan that shows whether it is all.
    """
    if is_alone(names):
        return scan_inside(engine, names, limits)
    named = [(c, p) for c, p in ranked if c is not None][:_RIVALS]
    tied = [(c, p) for c, p in named if p > 0.02]
    rivals = tied if len(tied) > 1 else named[:2]
    if len(rivals) < 2:
        return None
    said = [Hypothesis(c.name, c.plain.effects, np.asarray(c.plain.values), p) for c, p in rivals]
    return next_scan(engine, fitted.whitener, fitted.refit.base, said, limits)


def _reason(attribution: Attribution, top: Candidate, content: dict[str, Any]) -> str:
    none = attribution.none.rich
    lines = max(none.errors.locked.size, 1)
    text = f"chi-square a line: {none.locked / lines:.3g} without any effect"
    if top.effects:
        text += f", {top.rich.locked / lines:.3g} with {top.name}"
    return f"{text}. {content['gap']['sentence']}".strip()


def _notes(engine: Engine, fitted: Fitted, top: Candidate, rich: bool) -> tuple[str, ...]:
    recording, notes = engine.recording, []
    if not fitted.spectrum.known:
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
            f"{top.rich_refit.base.operator.count} plays."
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
