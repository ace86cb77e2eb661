"""The content of `diagnosis.json`: plain numbers, lists and names, key by key."""

import dataclasses
import math
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting._units import quantity
from rapi_jax import ECDL, Recording
from rapi_jax.effects import AbstractEffect

from ._text import describe_effects
from .family._law import threshold_law
from .how_far._cross_validation import CrossValidation
from .how_far._predicted_gain import PredictedGain, predict_gain
from .how_far._shares import effect_shares, run_shares
from .noise._periods import PeriodBlock
from .refit._effect_vector import Effects
from .refit._gauss_newton import Refit, State
from .refit._whitened_model import WhitenedModel
from .refit.estimates._derived import derive_quantities
from .refit.estimates._estimates import estimate_effects
from .where._description import describe_localisation
from .where._gap import Gap, measure_gap, split_gap
from .where._localisation import localise
from .where._residual_profiles import remove_origin, residual_profiles
from .which._base import FittedBase
from .which._candidate import Candidate
from .which._effect_sets import mechanism_name
from .which._forward_selection import Attribution
from .which._ranking import RankedCandidates, choose_refit, needs_flexible_base
from .which._thresholds import THRESHOLDS
from .which.signature._signature import describe_signatures


def describe_gap(whitened: WhitenedModel, fitted: FittedBase, none: Candidate) -> dict[str, Any]:
    """The gap of the base before any effect is added, and where it lies: `gap`, `where`, `maps`.

    Of a model that was brought, its own errors are localised, and divided into what repeats and
    what does not.
    """
    blocks, spectrum, own = whitened.blocks, fitted.spectrum, whitened.own_origin
    errors = none.on_base.errors.raw
    whole, told, total = _measure_base_gap(whitened, fitted, none), None, None
    if fitted.given is not None:
        told = measure_gap(fitted.given, blocks, spectrum, own_origin=own)
        total = told.total
    parts = split_gap(total, whole.total, whole.noise_floor)
    told = told or whole
    shown = fitted.given if fitted.given is not None else errors
    entries = localise(shown, blocks, spectrum, whitened.recording, own_origin=own)
    profiles = residual_profiles(shown, blocks, spectrum, whitened.recording, own_origin=own)
    return {
        "gap": parts
        | {
            "locked": _root(told.synchronous),
            "not_locked": _root(told.nonsynchronous),
            "significant": whole.significant and parts["structural"] != 0,
            "sentence": describe_localisation(
                entries,
                profiles,
                repeats=_repeats(blocks),
                drive_unit=whitened.recording.drive_unit,
            ),
        },
        "where": entries,
        "maps": profiles,
    }


def describe_shrinkage(
    whitened: WhitenedModel,
    fitted: FittedBase,
    none: Candidate,
    top: Candidate,
    held_out: CrossValidation | None,
    *,
    total: float,
    floor: float | None,
) -> dict[str, Any]:
    """How far the gap closes with `top`: on held-out data, and as predicted of other scans.

    `total`, `floor`: of the gap and of noise, as `describe_gap` has them. Where nothing was held
    out nothing is known to close.
    """
    blocks, spectrum, own = whitened.blocks, fitted.spectrum, whitened.own_origin
    before, after = held_out.rms(own) if held_out else (total, total)
    flexible = needs_flexible_base(top)
    refitted = choose_refit(top, fitted.refit, flexible=flexible)
    left = refitted[1].errors.raw
    remainder = localise(left, blocks, spectrum, whitened.recording, own_origin=own)
    _, without = choose_refit(none, fitted.refit, flexible=flexible)
    gain = predict_gain(whitened, spectrum, without, refitted, held_out)
    unit = whitened.recording.response_unit
    return {
        "before": before,
        "after": after,
        "floor": floor,
        "closed_fraction": held_out.closed if held_out else None,
        "held_out": [p["part"] for p in held_out.parts] if held_out else [],
        "by_part": held_out.parts if held_out else [],
        "by_run": run_shares(whitened.recording, without.errors.raw, left, blocks, own_origin=own)
        if top.effects
        else [],
        "foreseen": None if gain is None else gain.closed,
        "straighter": None if gain is None else gain.linearity_gain,
        "nonlinearity": _describe_nonlinearity(whitened.recording, gain),
        "remainder": describe_localisation(
            remainder,
            repeats=_repeats(blocks),
            what=f"what remains above the noise ({quantity(_size(remainder), unit)} rms)",
            drive_unit=whitened.recording.drive_unit,
        ),
    }


def _size(where: list[dict[str, Any]]) -> float:
    """Rms over all readings of what the entries of `localise` have above the noise."""
    squares = [e["of_readings"] * (e["rms"] ** 2 + e["rms_not_locked"] ** 2) for e in where]
    return math.sqrt(sum(squares))


def _describe_nonlinearity(recording: Recording, gain: PredictedGain | None) -> dict | None:
    """Rms of a compensated scan about its line, before and after the drive allows for the effects.

    `None` where nothing is predicted, or no drive can allow for them.
    """
    if gain is None or gain.linearity_gain is None:
        return None
    drive, factor = recording.runs[gain.run].drive, gain.linearity_gain
    ends = {"low": "high", "value": "value", "high": "low"}
    return {
        "excitation_hz": drive.rate,
        "amplitude": drive.u_pp,
        "before": gain.nonlinearity,
        "after": {key: gain.nonlinearity / factor[of] for key, of in ends.items()},
    }


def describe_signature(
    whitened: WhitenedModel, fitted: FittedBase, none: Candidate, top: Candidate
) -> list[dict[str, Any]]:
    """The signatures of the named effects beside the data; none where none is named.

    Without an effect: what the identified base leaves, with the other effects as they were found.
    For one effect `gap` has it. A flexible base takes up much of an effect that it lacks, and what
    it then leaves looks like nothing.
    """
    _, state = choose_refit(top, fitted.refit, flexible=needs_flexible_base(top))
    names = {effect.name for effect in top.effects}
    shown = tuple(effect for effect in state.effects if effect.name in names)
    without = (
        [_least_base_errors(whitened, fitted, none)]
        if len(shown) == 1
        else [_errors_without(top, effect, state.effects) for effect in shown]
    )
    return describe_signatures(
        shown,
        without,
        state.errors.raw,
        whitened.blocks,
        whitened.recording,
        own_origin=whitened.own_origin,
    )


def _errors_without(
    top: Candidate, effect: AbstractEffect, effects: Effects
) -> list[Float[np.ndarray, "_ _"]]:
    """Errors of the identified base, refitted with all of `effects` but one, which are held."""
    others = tuple(one for one in effects if one is not effect)
    held = dataclasses.replace(top.refit, hold_effects=True)
    begin = held.evaluate(top.on_base.values, others)
    return held.minimise(begin, THRESHOLDS.full_steps).errors.raw


def _least_base_errors(
    whitened: WhitenedModel, fitted: FittedBase, none: Candidate
) -> list[Float[np.ndarray, "_ _"]]:
    """Errors of the base refitted; of the model as brought where a refit takes nothing away."""
    refitted = none.on_base.errors.raw
    if fitted.given is None:
        return refitted
    own = whitened.own_origin
    both = (remove_origin(e, whitened.blocks, own_origin=own) for e in (fitted.given, refitted))
    given, after = (sum(float((e**2).sum()) for e in errors) for errors in both)
    return refitted if after < given else fitted.given


def describe_base(whitened: WhitenedModel, fitted: FittedBase) -> dict[str, Any]:
    """The law of the base's thresholds, its operator, and the evidence of all that were fitted."""
    recording, operator = whitened.recording, fitted.operator
    law = threshold_law(operator, max(d.u_pp for d in recording.drives), recording.drive_unit)
    return {
        "family": law,
        "operator": type(operator).__name__,
        "log_evidence": {} if fitted.family is None else fitted.family.log_evidence,
    }


def describe_richer_hysteresis(
    whitened: WhitenedModel, fitted: FittedBase, refit: Refit, state: State
) -> dict[str, Any]:
    """The number of plays of a hysteresis richer than the identified one, and what it leaves."""
    own = whitened.own_origin
    left = measure_gap(state.errors.raw, whitened.blocks, fitted.spectrum, own_origin=own)
    return {"plays": refit.base.operator.count, "rms": left.total}


def describe_model(model: ECDL) -> dict[str, Any]:
    """The model with the named effect, and the file that holds it."""
    return {
        "operator": type(model.operator).__name__,
        "effects": [type(effect).__name__ for effect in model.effects],
        "plays": model.operator.count,
        "file": "model.rapi",
    }


def describe_recording(whitened: WhitenedModel, recorded: Recording) -> dict[str, Any]:
    """What was diagnosed, after decimation; `recorded`: before."""
    recording = whitened.recording
    return {
        "runs": len(recording.runs),
        "samples": int(sum(d.size for d in recording.drives)),
        "samples_recorded": int(sum(d.size for d in recorded.drives)),
        "rates_hz": recording.rates,
        "amplitudes": recording.amplitudes,
        "periods": [b.periods for b in whitened.blocks],
        "drive_unit": recording.drive_unit,
    }


def describe_hypotheses(
    whitened: WhitenedModel,
    fitted: FittedBase,
    attribution: Attribution,
    ranked: RankedCandidates,
    held_out: dict[str, CrossValidation],
) -> list[dict[str, Any]]:
    """Each hypothesis, likeliest first, with its parameters and what it explains."""
    out: list[dict[str, Any]] = []
    entry: dict[str, Any]
    recording = whitened.recording
    cost = {c.name: c.cost for c in (attribution.none, *attribution.candidates)}
    for candidate, probability in ranked:
        if candidate is None:
            entry = {"effects": [], "name": "unlisted", "mechanism": "unlisted"}
            out.append(entry | {"probability": probability})
            continue
        entry = {
            "effects": sorted(effect.name for effect in candidate.effects),
            "name": candidate.name,
            "mechanism": mechanism_name(candidate.effects),
            "probability": probability,
        }
        if candidate.effects:
            validated = held_out.get(candidate.name)
            flexible, other = needs_flexible_base(candidate), None
            if flexible and candidate.name not in held_out:  # no operator was searched for it
                refit, state = candidate.flexible_refit, candidate.on_flexible_base
            else:
                refit, state = choose_refit(candidate, fitted.refit, flexible=flexible)
                if flexible and fitted.spectrum.measured and not candidate.has_other_form:
                    other = candidate.on_flexible_base.effects
            found = estimate_effects(
                refit,
                state,
                recording.response_unit,
                recording.drive_unit,
                of_jumps=probability > THRESHOLDS.likely_probability,
                on_other_base=other,
            )
            entry |= {
                "survival": candidate.unabsorbed_fraction,
                "parameters": found,
                "derived": derive_quantities(state.effects, found, recording),
                "closed_fraction": validated.closed if validated else None,
                "shares": effect_shares(entry["effects"], cost),
                "delta_chi2": attribution.none.cost - candidate.cost,
                "sentence": describe_effects(candidate.effects, recording.response_unit),
            }
        out.append(entry)
    return out


def _measure_base_gap(whitened: WhitenedModel, fitted: FittedBase, none: Candidate) -> Gap:
    return measure_gap(
        none.on_base.errors.raw,
        whitened.blocks,
        fitted.spectrum,
        own_origin=whitened.own_origin,
        fitted=int(fitted.refit.base.free.sum()),
    )


def _repeats(blocks: list[PeriodBlock]) -> bool:
    return any(block.periods > 1 for block in blocks)


def _root(square: float) -> float:
    return float(np.sqrt(max(square, 0.0)))
