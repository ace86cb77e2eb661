"""`check_against`: a new recording against the population of a device."""

from pathlib import Path

import numpy as np
from scipy import stats

from fitting._multiple_tests import adjust_holm
from fitting.identification._result import FitResult
from rapi_jax import DataError, ModelError
from rapi_jax.internal import float64, takes

from ._change import Change, ParameterChange, change_probabilities, credible_changes
from ._population import Population
from ._predictive_test import predictive_test
from ._thresholds import THRESHOLDS
from .estimates._record import Record, read_record


@takes(population=Population, result=FitResult | Path)
@float64
def check_against(population: Population, result: FitResult | Path) -> Change:
    """Whether a new recording is as the population predicts, and if not, which parameter changed.

    The prediction is for the recording's own time and temperature. Its covariance is of means and
    drift, of the scatter between recordings, and of the errors of the recording's own fit; since
    the scatter is estimated, p-values are by F and t with degrees of freedom after Kenward and
    Roger (1997).

    **Arguments:**

    - `result`: a fit of the new recording, or the folder (or `model.json`) that it wrote.

    **Returns** a `Change`. Raises `DataError` where the file is damaged, the fit is not like those
    of the population, the recording is one of them, or it lacks a covariate; `ModelError` where its
    fit is not to be trusted, or has no estimate in common with the population.

    >>> from fitting import check_against, fit, fit_population
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> days = [paper_recording(samples=400, periods=2, seed=k)[0] for k in range(6)]
    >>> fits = [fit(paper_device(), day, starts=2, hold_out=False) for day in days]
    >>> check_against(fit_population(fits[:5]), fits[5]).changed
    False
    """
    return check_record(population, read_record(result, 0))


def check_record(population: Population, record: Record) -> Change:
    """What `record` has changed; see `check_against`."""
    if not record.trusted:
        raise ModelError(
            f"{record.label}: its fit is not to be trusted, so it says nothing of a change: "
            f"{'; '.join(record.reasons)}."
        )
    if not population.excludes(record.sha256):
        raise DataError(
            f"{record.label}: this recording is one of the population. Leave it out there, so that "
            "it is compared with the others."
        )
    estimates, model = population.estimates, population.model
    values, own, known = estimates.of(record)
    if not known.any():
        raise ModelError(
            f"{record.label}: it has no estimate of any parameter of the population "
            f"({', '.join(estimates.names)})."
        )
    design, rest = population.design_of(record)
    before = model.predictive(design) + np.diag(rest)
    at = np.flatnonzero(known)
    pick = np.ix_(at, at)
    variance = (before + own)[pick]
    difference = (values - design @ model.coefficients)[at]
    slopes = model.slopes(design)[:, at][:, :, at]
    pairs = model.pair_covariance
    whole = predictive_test(difference, variance, slopes, pairs)
    alone = [
        predictive_test(
            difference[j : j + 1], variance[j : j + 1, j : j + 1],
            slopes[:, j : j + 1, j : j + 1], pairs,
        ).p_value
        for j in range(at.size)
    ]  # fmt: skip
    inverse = np.linalg.inv(variance)
    error = 1.0 / np.sqrt(np.diag(inverse))
    change = error**2 * (inverse @ difference)
    given = _given_others(change / error, whole.statistic, whole.denominator, whole.wishart)
    names = [estimates.names[j] for j in at]
    probabilities = change_probabilities(names, change / error, whole.statistic, whole.wishart)
    p_alone, p_given = adjust_holm(np.array(alone)), adjust_holm(given)
    p_change = min(1.0, 2.0 * min(whole.p_value, float(p_given.min())))
    scale, used = estimates.scale, population.covariates.names
    days = population.covariates.value("time", record) if "time" in used else None
    usual = population.expectation(days=days).values
    parameters = []
    for j, name in enumerate(estimates.names):
        expected = float(scale[j] * (design[j] @ model.coefficients))
        spread = float(scale[j] * np.sqrt(before[j, j]))
        common = (name, estimates.units[j], expected, spread, float(usual[j]))
        if not known[j]:
            parameters.append(ParameterChange(*common, *[float("nan")] * 9))
            continue
        k = int(np.flatnonzero(at == j)[0])
        parameters.append(
            ParameterChange(
                *common, float(scale[j] * values[j]), float(scale[j] * np.sqrt(own[j, j])),
                float(alone[k]), float(p_alone[k]), float(scale[j] * change[k]),
                float(scale[j] * error[k]), float(given[k]), float(p_given[k]),
                probabilities[name],
            )
        )  # fmt: skip
    return Change(
        label=record.label,
        p_value=whole.p_value,
        statistic=whole.statistic,
        degrees=(float(whole.numerator), whole.denominator),
        p_change=p_change,
        changed=p_change < THRESHOLDS.change_level,
        parameters=tuple(parameters),
        probabilities=probabilities,
        set=credible_changes(probabilities),
        notes=tuple(_notes(population, record, known)),
        days=days,
    )


def _given_others(z: np.ndarray, statistic: float, degrees: float, wishart: float) -> np.ndarray:
    """P-value of each parameter's change, all others being as before.

    Rao's test of additional information, exact for a Wishart variance: of what a parameter adds to
    the statistic of the others.
    """
    if not np.isfinite(wishart):
        return stats.chi2.sf(z**2, 1)
    others = np.maximum(statistic - z**2, 0.0)
    return stats.f.sf(z**2 * degrees / (wishart + others), 1, degrees)


def _notes(population: Population, record: Record, known: np.ndarray) -> list[str]:
    notes = []
    missing = [name for name, k in zip(population.names, known, strict=True) if not k]
    if missing:
        notes.append(f"no estimate of {', '.join(missing)} in this recording: not looked at.")
    for name, unit, key in (("time", "days", "days"), ("temperature", "deg C", "temperature_c")):
        if name not in population.covariates.names:
            continue
        seen = [float(getattr(one, key)) for one in population.recordings if not one.outlier]
        value = population.covariates.value(name, record)
        slack = 0.05 * (max(seen) - min(seen))
        if not min(seen) - slack <= value <= max(seen) + slack:
            notes.append(
                f"its {name}, {value:.4g} {unit}, is beyond the population's, {min(seen):.4g} to "
                f"{max(seen):.4g}: the drift is extrapolated."
            )
    return notes
