"""`diagnose`: where the gap between model and recording lies, its cause, how far it closes."""

import dataclasses
import time
from collections.abc import Callable, Sequence

import numpy as np

from fitting._threads import one_blas_thread
from fitting.compile_cache._memory_maps import SHARED, forget_programs
from fitting.identification.data_checks.runs._change_fault import (
    DIFFERS_WITH_RATE,
    LEFT_TO_EFFECTS,
)
from rapi_jax import ECDL, DriveLimits, Recording, effects
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import float64, takes

from ._content import (
    describe_base,
    describe_gap,
    describe_hypotheses,
    describe_model,
    describe_recording,
    describe_richer_hysteresis,
    describe_shrinkage,
    describe_signature,
)
from ._data_checks import (
    NOTHING_EXPLAINED,
    check_candidates,
    check_data,
    find_inconsistencies,
    shown_faults,
)
from ._diagnosis import Diagnosis
from ._repetition import with_repetition
from ._text import effect_labels
from ._verdict import (
    blame_data,
    collect_notes,
    describe_doubted_laws,
    describe_family,
    doubt_data,
    doubt_noise,
    explain_random_jumps,
    explain_richer_hysteresis,
    give_verdict,
    laws_of_hysteresis,
    mention_likeliest,
)
from .base_misfit._remainder import is_beyond_hysteresis
from .detectability._detectability import smallest_sizes
from .how_far._cross_validation import cross_validate
from .next_scan._proposal import propose_next_scan
from .noise._periods import decimate
from .noise._residual_whiteness import measure_whiteness
from .noise._telegraph import RandomJumps, find_random_jumps
from .refit._whitened_model import WhitenedModel
from .which._base import FittedBase, fit_base
from .which._candidate import Candidate
from .which._excess import is_unexplained
from .which._ranking import (
    choose_refit,
    is_hidden_by_operator,
    likely_candidates,
    match_candidates,
    needs_flexible_base,
)
from .which._refined_noise import select_with_refined_noise
from .which._shifted_runs import faults_of_origin, in_any_form
from .which.evidence._calibration import load_calibration
from .which.evidence._conformal import answer_type, credible_set, widen
from .which.evidence._evidence import Evidence
from .which.evidence._probability import (
    doubt_all,
    doubt_law,
    doubt_none,
    doubt_remainder,
    doubt_unknown_noise,
    doubt_unpredictive,
    hypothesis_probabilities,
    withhold_judgment,
)
from .which.refits._family_refit import with_fixed_thresholds

Progress = Callable[[str], None]


@takes(ecdl=ECDL | None, recording=Recording, limits=DriveLimits | None)
@float64
@one_blas_thread
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
    (constant readings, no complete period, fewer samples than parameters), and `TypeError` for
    arguments of the wrong type.

    >>> import numpy as np
    >>> from fitting import diagnose
    >>> from rapi_jax import ECDL, Recording, predict
    >>> from rapi_jax.effects import Delay, Etalon
    >>> from rapi_jax.examples import paper_device, paper_drives
    >>> etalon = Etalon.at(amplitude=0.3, spacing=7.0)  # GHz
    >>> laser = ECDL(paper_device().operator, (etalon,))
    >>> drives = paper_drives(samples=800, periods=4)
    >>> noise = np.random.default_rng(0).normal(0.0, 0.02, (4, 800))  # GHz
    >>> readings = [np.asarray(predict(laser, d)) + n for d, n in zip(drives, noise)]
    >>> recording = Recording.of(drives, readings)
    >>> found = diagnose(None, recording, candidates=(Delay, Etalon), scan=False)
    >>> found.verdict.name
    'etalon'
    >>> found.content["shrinkage"]["closed_fraction"]["value"] > 0.99  # of the gap, held out
    True
    """
    began = time.perf_counter()
    forget_programs(SHARED)
    report = progress or (lambda line: None)
    check_candidates(candidates)
    check_data(ecdl, recording)
    whitened = WhitenedModel.of(decimate(with_repetition(recording)))
    blocks = whitened.blocks

    report("base model")
    fitted = fit_base(whitened, ecdl)
    report("consistency of the runs")
    found = find_inconsistencies(
        whitened.recording,
        fitted.state.to_ecdl(whitened, fitted.refit.base).operator,
        explained=fitted.spectrum.measured and not is_unexplained(fitted.state),
    )
    broken = [fault for fault in found if fault.kind not in LEFT_TO_EFFECTS]
    classes = effects.ALL if candidates is None else tuple(dict.fromkeys(candidates))
    classes = () if broken else classes  # an effect would only imitate what is wrong with the data
    fitted, attribution = select_with_refined_noise(fitted, classes, report)
    other = with_fixed_thresholds(fitted, attribution.best)
    if other is not None:
        report("thresholds fixed in volts")
        fitted, attribution = select_with_refined_noise(other, classes, report)
    attribution = in_any_form(attribution, found)
    broken += faults_of_origin(fitted, attribution, found)

    evidence = Evidence.of(attribution, noise_known=fitted.spectrum.measured)
    ranked = match_candidates(attribution, hypothesis_probabilities(evidence))
    flexible = needs_flexible_base(ranked[0][0] or attribution.none)

    report("held-out data")
    none = choose_refit(attribution.none, fitted.refit, flexible=flexible)
    likely = likely_candidates(attribution, ranked)
    refits = [choose_refit(candidate, fitted.refit, flexible=flexible) for candidate in likely]
    validated = cross_validate(whitened, none, refits, report)
    held_out = {c.name: v for c, v in zip(likely, validated, strict=True) if v is not None}

    # What stays open on held-out data tells whether something is missing that is not listed.
    # The equation of an effect in another form is known to leave much; and where the operator
    # misfits more than the effect does, held-out data tell of the operator.
    equations = {
        c.name
        for c, (_, end) in zip(likely, refits, strict=True)
        if not c.has_other_form and not is_hidden_by_operator(c, none[1], end)
    }
    closed = {name: v.closed for name, v in held_out.items() if v.closed and name in equations}
    values = {name: found["value"] for name, found in closed.items()}
    probabilities = doubt_unpredictive(hypothesis_probabilities(evidence, values), closed)
    first = match_candidates(attribution, probabilities)[0][0]
    if first is not None and first.effects and not first.has_other_form:
        if fitted.spectrum.measured and is_beyond_hysteresis(first.on_flexible_base):
            probabilities = doubt_remainder(probabilities)
    laws = laws_of_hysteresis(fitted.family, classes)
    probabilities = doubt_law(probabilities, laws)
    if not fitted.spectrum.measured:
        probabilities = doubt_unknown_noise(probabilities)
    jumps = _random_jumps(fitted, first or attribution.none, flexible=flexible)
    if jumps is not None:
        probabilities = doubt_all(probabilities)
    left = None if fitted.spectrum.measured else measure_whiteness(none[1].errors.raw, blocks)
    if left is not None and left.doubts:
        probabilities = doubt_none(probabilities)
    calibration = load_calibration()
    factor = calibration.widening.get(answer_type(probabilities[0][0]), 1.0)
    probabilities = widen(probabilities, calibration.widening)
    ranked = match_candidates(attribution, probabilities)
    top = ranked[0][0] or attribution.none
    refit, state = choose_refit(top, fitted.refit, flexible=flexible)
    named = tuple(effect.name for effect in top.effects)
    faults = found + shown_faults(recording, state.errors.raw, whitened, named, found)
    blamed = broken or [fault for fault in faults if fault.kind == NOTHING_EXPLAINED]
    if blamed:
        probabilities = withhold_judgment()
        ranked = match_candidates(attribution, probabilities)
        top = attribution.none
        refit, state = choose_refit(top, fitted.refit, flexible=flexible)
    credible = credible_set(probabilities)
    name, probability = probabilities[0]

    gap = describe_gap(whitened, fitted, attribution.none)
    total, floor = gap["gap"]["total"], gap["gap"]["noise_floor"]
    shrinkage = describe_shrinkage(
        whitened, fitted, attribution.none, top, held_out.get(name), total=total, floor=floor
    )

    sizes = []
    if not blamed and name != "unlisted":  # beside something unknown nothing can be promised
        report("smallest effects that would show")
        sizes = smallest_sizes(top, classes, attribution.none.cost - top.cost)

    next_scan = None
    if scan and not blamed:
        report("next scan")
        next_scan = propose_next_scan(whitened, fitted, ranked, evidence, credible, limits)

    verdict = give_verdict(
        name, probability, credible, top, attribution.none, gap, shrinkage, next_scan, recording,
        plays=refit.base.operator.count if flexible else None,
    )  # fmt: skip
    verdict = mention_likeliest(verdict, ranked, held_out, recording.response_unit)
    richer = None
    if flexible and name == "none" and not blamed:
        richer = describe_richer_hysteresis(whitened, fitted, refit, state)
        verdict = explain_richer_hysteresis(verdict, richer, total, floor, recording.response_unit)
    if name == "unlisted" and faults and faults[0].kind != DIFFERS_WITH_RATE:
        verdict = doubt_data(verdict, faults)
    if jumps is not None:
        synchronous = gap["gap"]["locked"]
        verdict = explain_random_jumps(verdict, jumps, synchronous, recording.response_unit)
    if left is not None:
        verdict = doubt_noise(verdict, left, recording.response_unit, shrinkage["closed_fraction"])
    model = state.to_ecdl(whitened, refit.base)
    base = none[1].to_ecdl(whitened, none[0].base)
    if blamed:
        verdict = blame_data(verdict, blamed)
    content = {
        "recording": describe_recording(whitened, recording),
        **gap,
        "hypotheses": describe_hypotheses(whitened, fitted, attribution, ranked, held_out),
        "signature": describe_signature(whitened, fitted, attribution.none, top),
        "shrinkage": shrinkage,
        "detectability": [size.to_dict() for size in sizes],
        "next_scan": None if next_scan is None else next_scan.to_dict(),
        "calibration": {
            "bank": calibration.provenance,
            "widening": factor,
            "sets": calibration.widening_provenance,
            "reliability": [dict(part) for part in calibration.reliability],
        },
        "evidence": evidence.to_dict(),
        "base": describe_base(whitened, fitted) | ({"richer": richer} if richer else {}),
        "model": describe_model(model),
        "faults": [dataclasses.asdict(fault) for fault in faults],
    }
    notes = tuple(f"{fault.kind}: {fault.message}" for fault in faults)
    notes += describe_family(whitened, fitted)
    notes += describe_doubted_laws(laws, credible, recording.response_unit)
    notes += collect_notes(whitened, fitted, top, flexible=flexible)
    seconds = time.perf_counter() - began
    drive = None if next_scan is None else next_scan.drive
    labels = effect_labels(classes, recording.response_unit)
    return Diagnosis(recording, model, base, verdict, content, notes, seconds, drive, labels)


def _random_jumps(fitted: FittedBase, top: Candidate, *, flexible: bool) -> RandomJumps | None:
    """Jumps in what `top` leaves and does not repeat; `None` where there are none for sure.

    Where a mode hop is named its instants differ from period to period by themselves.
    """
    named = {effect.name for effect in top.effects}
    if not fitted.spectrum.measured or "mode_hop" in named or top.has_other_form:
        return None
    refit, state = choose_refit(top, fitted.refit, flexible=flexible)
    jumps = find_random_jumps(state.errors.raw, refit.whitened.blocks)
    return jumps if jumps.sure else None
