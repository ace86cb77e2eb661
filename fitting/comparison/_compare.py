"""`compare`: what changed between two recordings of one device."""

import time
from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy import stats

from fitting._parameter_words import describe_parameter
from fitting.identification._identify import identify
from fitting.identification._options import Progress
from fitting.identification._result import FitResult
from fitting.population._change import change_probabilities, credible_changes
from rapi_jax import ECDL, Recording
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import float64, takes

from ._check_pair import cautions, check_pair
from ._comparison import Comparison
from ._difference_test import DifferenceTest, compare_estimates, detectable_changes
from ._differences import Interval, ParameterDifference
from ._effects import effects_test, named_effects, with_sizes
from ._estimates import PairEstimates, estimate_pair
from ._failures import failed_fits, failed_joint_fit
from ._joint_fit import Two, fit_jointly, linearise, rms, shared_errors
from ._residual_curves import residual_curves
from ._response_change import ModelErrors, change_by_drive, gap_change, response_change
from ._single_changes import contrast_changes, single_changes
from ._thresholds import THRESHOLDS

_OF_A_SESSION = ("d_0", "Pickup.phase")


@takes(before=Recording, after=Recording, ecdl=ECDL | None)
@float64
def compare(
    before: Recording,
    after: Recording,
    *,
    ecdl: ECDL | None = None,
    effects: bool = False,
    candidates: Sequence[type[AbstractEffect]] | None = None,
    without: tuple[str, ...] = _OF_A_SESSION,
    progress: Progress | None = None,
) -> Comparison:
    """What changed between `before` and `after`: which parameters, by how much, how sure that is.

    One model is fitted to each recording alone, with the same parameters free, from one start, and
    to both together. The increase in misfit of one model over two is computed from the covariances
    of the estimates, which are corrected for correlated residuals; p-values and intervals are by F
    and t.

    **Arguments:**

    - `ecdl`: the model to fit, with its effects; by default identified on `before`.
    - `effects`: diagnose each recording, and add the effects named in either to the model. One that
      both have is fitted to each and compared; one that is named in one alone is off in the other.
    - `candidates`: classes of effects for that; `rapi_jax.effects.ALL` by default.
    - `without`: parameters that are no property of the device, and are no part of the answer.
    - `progress`: called with a line before each step.

    **Returns** a `Comparison`. Raises `DataError` where units differ, where the drives have no
    range in common or where both are the same data; `ModelError` where no parameter has an estimate
    in both; `TypeError` for arguments of the wrong type.

    >>> from fitting import compare
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> monday, _ = paper_recording(samples=400, periods=2)
    >>> friday, _ = paper_recording(samples=400, periods=2, seed=1)
    >>> compare(monday, friday, ecdl=paper_device()).changed
    False
    """
    began = time.perf_counter()
    report = progress or (lambda line: None)
    check_pair(before, after)
    pair = before, after
    given = ecdl
    if ecdl is None:
        report("one model")
        ecdl = identify(before, hold_out=("last third",), throw=False).ecdl
    presence, models = None, (ecdl, ecdl)
    if effects:
        models, presence = named_effects(ecdl, given, pair, candidates, report)
        ecdl = models[0]
    names_of = {type(effect).name: type(effect).__name__ for effect in ecdl.effects}
    only_in = {names_of[e.effect]: e.only_in for e in presence or () if e.only_in}
    estimates = estimate_pair(models, pair, without, report, only_in=only_in)
    report("both together")
    names, alone, steps = list(estimates.names), estimates.values, estimates.steps
    size, degrees = len(names), estimates.degrees
    errors = shared_errors(estimates)
    joint = fit_jointly(errors, alone, steps, size)
    about: Two = (joint.before, joint.after)
    values, covariances = linearise(errors, alone, about, steps)
    test = compare_estimates(values, covariances, size, degrees)
    report("what each fit leaves")
    own = estimates.results[0].ecdl, estimates.results[1].ecdl
    counts = int(estimates.records[0].free.sum()), int(estimates.records[1].free.sum())
    own_left = ModelErrors.of(own[0], before), ModelErrors.of(own[1], after)
    misfit = gap_change("the own fit of each", own_left, fitted=counts)
    # Two tests of the parameters, and one of what they leave.
    p_parameters = test.p_change if misfit is None else min(1.0, 1.5 * test.p_change)
    p_misfit = 1.0 if misfit is None else min(1.0, 3.0 * misfit.p_value)
    p_effects = 1.0 if presence is None else effects_test(presence, names_of, estimates)
    p_change = min(p_parameters, p_misfit, p_effects)
    parameters_changed = p_parameters < THRESHOLDS.change_level
    misfit_changed = p_misfit < THRESHOLDS.change_level
    tests = 2 if misfit is None else 3
    detectable = detectable_changes(test, tests)
    parts = zip(errors, about, steps, strict=True)
    slopes = np.concatenate([e.slopes(p, h)[:, :size] for e, p, h in parts])
    moves = np.sqrt(np.mean(slopes**2, axis=0))
    detectable_response = float(np.max(detectable * moves))
    z, statistic, found = test.change / test.change_stderr, test.statistic, test
    if parameters_changed:
        report("which parameter changed")
        singles = single_changes(errors, alone, joint, steps, size, degrees)
        z, statistic = contrast_changes(singles)
    probabilities = change_probabilities(names, z, statistic, test.degrees[1])
    likely = credible_changes(probabilities)
    if parameters_changed:  # estimates are to first order about a model that has the change
        about = alone
        if likely[0] in names:
            about = singles[names.index(likely[0])].about
        values, covariances = linearise(errors, alone, about, steps)
        found = compare_estimates(values, covariances, size, degrees)
    report("change of the response")
    reference = "the model brought" if given is not None else "the fit of the first recording"
    model = own[0] if given is None else given
    left = ModelErrors.of(model, before), ModelErrors.of(model, after)
    failures = failed_fits(errors, alone, models, before.response_unit)
    if not parameters_changed and not failures:
        failures = failed_joint_fit(estimates, errors, joint, before.response_unit)
    if presence is not None:
        presence = with_sizes(presence, names_of, estimates, values, covariances)
    notes = [*failures, *estimates.notes, *cautions(before, after), *_doubts(estimates.results)]
    return Comparison(
        unit=before.response_unit,
        drive_unit=before.drive_unit,
        changed=p_change < THRESHOLDS.change_level,
        p_change=p_change,
        p_value=test.p_value,
        statistic=test.statistic,
        degrees=test.degrees,
        parameters=()
        if failures
        else tuple(
            _differences(estimates, values, covariances, found, test, probabilities, detectable)
        ),
        probabilities=probabilities,
        set=likely,
        response=response_change(errors, alone, about, covariances),
        detectable_response=detectable_response,
        response_by_drive=tuple(change_by_drive(errors, alone)),
        residuals=tuple(residual_curves(left, pair)),
        gap=gap_change(reference, left),
        misfit=misfit,
        misfit_changed=misfit_changed,
        parameters_changed=parameters_changed,
        effects=presence,
        recordings=tuple(
            _describe(result, rms(e(own)), joint.rmse[k])
            for k, (result, e, own) in enumerate(zip(estimates.results, errors, alone, strict=True))
        ),
        model={
            "operator": type(ecdl.operator).__name__,
            "effects": [type(effect).__name__ for effect in ecdl.effects],
            "plays": ecdl.operator.count,
            "joint": dict(zip(names, joint.before[:size].tolist(), strict=True)),
        },
        trusted=not failures and all(result.verdict.trusted for result in estimates.results),
        failures=tuple(failures),
        notes=tuple(notes),
        seconds=time.perf_counter() - began,
    )


def _differences(
    pair: PairEstimates,
    values: Two,
    covariances: Two,
    found: DifferenceTest,
    test: DifferenceTest,
    probabilities: dict[str, float],
    detectable: np.ndarray,
) -> list[ParameterDifference]:
    """Estimates as `found`; p-values given the others by `test`, which is about the joint fit."""
    half = float(stats.t.ppf(0.5 + 0.5 * THRESHOLDS.interval_level, found.degrees[1]))
    errors = [np.sqrt(np.diag(covariance)) for covariance in covariances]

    def interval(value: float, error: float) -> Interval:
        return Interval(float(value), float(value - half * error), float(value + half * error))

    return [
        ParameterDifference(
            name=name,
            words=describe_parameter(name, pair.results[0].recording.response_unit),
            unit=pair.unit(name),
            before=float(values[0][j]),
            before_stderr=float(errors[0][j]),
            after=float(values[1][j]),
            after_stderr=float(errors[1][j]),
            difference=interval(found.difference[j], found.stderr[j]),
            difference_stderr=float(found.stderr[j]),
            p_value=float(found.p[j]),
            p_holm=float(found.p_holm[j]),
            change=interval(found.change[j], found.change_stderr[j]),
            change_stderr=float(found.change_stderr[j]),
            p_given_others=float(test.p_given[j]),
            p_given_others_holm=float(test.p_given_holm[j]),
            probability=probabilities[name],
            detectable=float(detectable[j]),
        )
        for j, name in enumerate(pair.names)
    ]


def _doubts(results: tuple[FitResult, FitResult]) -> list[str]:
    return [
        f"the fit {label} is not to be trusted: {'; '.join(result.verdict.reasons)}"
        for label, result in zip(("before", "after"), results, strict=True)
        if not result.verdict.trusted
    ]


def _describe(result: FitResult, rmse: float, rmse_joint: float) -> dict[str, Any]:
    recording = result.recording
    when = recording.recorded_at
    return {
        "name": "",
        "runs": len(recording.runs),
        "samples": sum(drive.size for drive in recording.drives),
        "rates_hz": recording.rates,
        "amplitudes": recording.amplitudes,
        "rmse": rmse,
        "rmse_joint": rmse_joint,
        "trusted": result.verdict.trusted,
        "recorded_at": None if when is None else when.isoformat().replace("+00:00", "Z"),
        "temperature_c": recording.temperature_c,
        "data_sha256": result.data_sha256 or recording.sha256(),
    }
