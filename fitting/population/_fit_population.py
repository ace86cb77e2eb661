"""`fit_population`: a hierarchical fit over many recordings of one device."""

import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy import stats

from fitting.identification._result import FitResult
from rapi_jax.internal import float64

from ._covariates import UNITS, Covariates, covariates_of
from ._estimates import LEFT_OUT, Estimates, gather
from ._mixed_model import MixedModel
from ._outliers import leave_one_out, worst
from ._population import (
    Effect,
    Population,
    PopulationParameter,
    PopulationRecording,
    check_units,
)
from ._predictive_test import adjust_holm
from ._record import Record, read_record
from ._selection import STRUCTURES, Selected, select
from ._thresholds import THRESHOLDS


@float64
def fit_population(
    results: Sequence[FitResult | Path],
    *,
    covariates: Sequence[str] = ("time", "temperature"),
    drift: str = "auto",
    structure: str = "auto",
    without: Sequence[str] = LEFT_OUT,
    keep_outliers: bool = False,
    level: float = 0.95,
) -> Population:
    r"""Shared means, drift with time and temperature, and scatter of a device's parameters.

    The estimates of recording $i$ are taken as $\hat\theta_i \sim N(\mu + B x_i, T + C_i)$: $C_i$
    from its own fit, $T$ the covariance between recordings by restricted maximum likelihood, means
    and drift by generalised least squares (multivariate random-effects meta-regression: Jackson,
    Riley and White 2011), with the small-sample corrections of Kenward and Roger (1997).

    Parameters enter as they are, not as logarithms: their errors come from the model's derivatives
    with respect to them, and an error that goes with the estimate, as that of a logarithm does,
    would bias weighted means. Estimates at a bound have no such error and count as missing; a
    parameter whose normal distribution reaches beyond a bound is noted.

    **Arguments:**

    - `results`: fits of recordings of one device, or folders (or `model.json`) that fits wrote.
      Those not to be trusted are left out and listed.
    - `covariates`: of "time" (`recorded_at`) and "temperature" (`temperature_c`). One that no
      recording has, or that never changes, is left out with a note.
    - `drift`: "line", "smooth" (a line and a Gaussian process in time, Matern 3/2, in every
      parameter) or "auto": smooth in those parameters where that has more evidence.
    - `structure`: of $T$: "diagonal", "factor" (diagonal, and one common cause), "full", or "auto":
      the one with the most evidence.
    - `without`: parameters that are no property of the device; by default `d_0`, the zero of the
      response, which is each recording's own.
    - `keep_outliers`: let outliers count. By default a recording that the others do not predict (at
      1 % for all together, one after the other) is reported and left out of means and scatter,
      unless there are more than a fifth.
    - `level`: of the confidence intervals.

    **Returns** a `Population`. Raises `DataError` where a file is damaged, fits are not alike, one
    recording counts twice, or some recordings lack a covariate; `ModelError` where trusted
    recordings are too few.
    """
    _check_arguments(drift, structure, level)
    records, left_out = _read(results)
    check_units(len(records), 1, THRESHOLDS.least_degrees)
    chosen, rows, notes = covariates_of(records, tuple(covariates))
    check_units(len(records), chosen.count, THRESHOLDS.least_degrees)
    estimates, more = gather(records, without, chosen.count)
    times = rows[:, 1 + chosen.names.index("time")] if "time" in chosen.names else None
    if drift == "smooth" and times is None:
        notes.append("without time there is no smooth drift.")

    def choose(known: np.ndarray) -> Selected:
        return select(estimates, rows, known, times=times, drift=drift, structure=structure)

    selected, known, p_values = _without_outliers(estimates, choose, keep_outliers, notes)
    model = selected.model(estimates, known)
    parameters = _parameters(estimates, chosen, selected, model, level)
    notes += more + _note_fit(selected, estimates, parameters)
    scatter = np.sqrt(np.diag(model.between))
    size = np.outer(scatter, scatter)
    correlation = np.where(size > 0, model.between / np.where(size > 0, size, 1.0), 0.0)
    np.fill_diagonal(correlation, 1.0)
    return Population(
        parameters=parameters,
        recordings=_recordings(estimates, chosen, model, p_values),
        left_out=tuple(left_out),
        notes=tuple(notes),
        structure=selected.variances.structure,
        correlation=correlation,
        evidence=selected.evidence,
        estimates=estimates,
        covariates=chosen,
        selected=selected,
        model=model,
    )


def _check_arguments(drift: str, structure: str, level: float) -> None:
    for name, value, allowed in (
        ("drift", drift, ("line", "smooth", "auto")),
        ("structure", structure, (*STRUCTURES, "auto")),
    ):
        if value not in allowed:
            raise ValueError(
                f"Argument `{name}` must be one of {', '.join(allowed)}, but is {value!r}."
            )
    if not 0.0 < level < 1.0:
        raise ValueError(f"Argument `level` must be between 0 and 1, but is {level}.")


def _read(results: Sequence[FitResult | Path]) -> tuple[list[Record], list[tuple[str, str]]]:
    """The records to use, in the order of time where all have one, and those left out."""
    read = [read_record(result, i) for i, result in enumerate(results)]
    records = [record for record in read if record.trusted]
    left_out = [
        (record.label, f"its fit is not to be trusted: {'; '.join(record.reasons)}")
        for record in read
        if not record.trusted
    ]
    times = [record.recorded_at for record in records]
    if None not in times:
        order = sorted(range(len(records)), key=lambda i: (times[i], i))
        records = [records[i] for i in order]
    return records, left_out


def _without_outliers(
    estimates: Estimates,
    choose: Callable[[np.ndarray], Selected],
    keep: bool,
    notes: list[str],
) -> tuple[Selected, np.ndarray, np.ndarray]:
    """The variance model, which estimates it is of, and the p-value of every recording.

    Outliers are taken out one after the other, the worst first, so that none hides another.
    """
    whole = estimates.known
    selected, known = choose(whole), whole.copy()
    found: dict[int, float] = {}
    most = int(THRESHOLDS.outlier_share * len(known))
    while True:
        p_values = leave_one_out(selected.model(estimates, known))
        at = worst(p_values)
        if keep or at is None or len(found) > most:
            break
        found[at] = float(p_values[at])
        known = known.copy()
        known[at] = False
        selected = selected.refit(known)
    if len(found) > most:
        notes.append(
            f"more than {most} recordings do not fit the others, which are no outliers but another "
            "population, such as a device that changed: none was left out, and means, drift and "
            "scatter are of both. Look at the picture, and fit each part by itself."
        )
        selected, known, found = choose(whole), whole, {}
        p_values = leave_one_out(selected.model(estimates, known))
    elif found:
        selected = choose(known)
        p_values = leave_one_out(selected.model(estimates, known))
        p_values[list(found)] = list(found.values())
    return selected, known, p_values


def _parameters(
    estimates: Estimates,
    covariates: Covariates,
    selected: Selected,
    model: MixedModel,
    level: float,
) -> tuple[PopulationParameter, ...]:
    size = estimates.size
    columns = []
    for effect in range(covariates.count):
        name = "mean" if effect == 0 else covariates.names[effect - 1]
        spread = 1.0 if effect == 0 else covariates.spreads[effect - 1]
        made = [
            _effect(model, effect * size + j, estimates.scale[j] / spread, level,
                    estimates.units[j] if effect == 0 else _per(estimates.units[j], UNITS[name]))
            for j in range(size)
        ]  # fmt: skip
        columns.append((name, _with_p(made) if effect else made))
    by_name = dict(columns)
    low, high = scatter_interval(model, covariates.count, level)
    scatter = np.sqrt(np.diag(model.between))
    nothing = [None] * size
    return tuple(
        PopulationParameter(
            name=estimates.names[j],
            unit=estimates.units[j],
            mean=by_name["mean"][j],
            time=by_name.get("time", nothing)[j],
            temperature=by_name.get("temperature", nothing)[j],
            scatter=float(scatter[j] * estimates.scale[j]),
            scatter_low=float(low[j] * estimates.scale[j]),
            scatter_high=float(high[j] * estimates.scale[j]),
            smooth=j in selected.variances.smooth,
        )
        for j in range(size)
    )


def _per(unit: str, of: str) -> str:
    return f"{unit}/{of}"


def _effect(model: MixedModel, at: int, factor: float, level: float, unit: str) -> Effect:
    contrast = np.zeros(model.coefficients.size)
    contrast[at] = 1.0
    degrees = max(model.degrees(contrast), 1.0)
    value = float(model.coefficients[at])
    stderr = float(np.sqrt(model.corrected_covariance[at, at]))
    half = float(stats.t.ppf(0.5 + 0.5 * level, degrees)) * stderr
    ends = (value, stderr, value - half, value + half)
    return Effect(*(float(factor * x) for x in ends), degrees, unit)


def _with_p(effects: list[Effect]) -> list[Effect]:
    p = np.array([2.0 * stats.t.sf(abs(e.value) / e.stderr, e.degrees) for e in effects])
    return [
        dataclasses.replace(e, p_value=float(one), p_holm=float(all_))
        for e, one, all_ in zip(effects, p, adjust_holm(p), strict=True)
    ]


def scatter_interval(
    model: MixedModel, effects: int, level: float
) -> tuple[np.ndarray, np.ndarray]:
    r"""Ends of confidence intervals of the scatter, standardised.

    The estimate of $\tau^2$ varies as if $\tau^2 + c$ had a chi-square distribution, with as many
    degrees as recordings less fixed effects: $c$, what errors of the single fits add, follows from
    its standard error. Exact where all recordings have equal errors.
    """
    degrees = np.maximum(model.known.sum(axis=0) - effects, 1)
    variance = np.diag(model.between)
    total = np.maximum(model.diagonal_stderr * np.sqrt(degrees / 2.0), variance)
    tail = 0.5 * (1.0 - level)
    low = total * degrees / stats.chi2.isf(tail, degrees) - (total - variance)
    high = total * degrees / stats.chi2.ppf(tail, degrees) - (total - variance)
    return np.sqrt(np.maximum(low, 0.0)), np.sqrt(np.maximum(high, 0.0))


def _recordings(
    estimates: Estimates,
    covariates: Covariates,
    model: MixedModel,
    p_values: np.ndarray,
) -> tuple[PopulationRecording, ...]:
    scale = estimates.scale
    shrunken, error = model.shrunken(estimates.known)
    holm = adjust_holm(p_values)
    out = []
    for i, record in enumerate(estimates.records):
        known = estimates.known[i]
        stderr = np.sqrt(np.diag(estimates.covariances[i])) * scale
        time = record.recorded_at
        out.append(
            PopulationRecording(
                label=record.label,
                recorded_at=time,
                days=covariates.days(time) if covariates.first and time else None,
                temperature_c=record.temperature_c,
                values=_tuple(np.where(known, estimates.values[i] * scale, np.nan)),
                stderr=_tuple(np.where(known, stderr, np.nan)),
                shrunken=_tuple(shrunken[i] * scale),
                shrunken_stderr=_tuple(error[i] * scale),
                p_value=float(p_values[i]),
                p_holm=float(holm[i]),
                outlier=bool(known.any() and not model.known[i].any()),
                sha256=record.sha256,
            )
        )
    return tuple(out)


def _tuple(values: np.ndarray) -> tuple[float, ...]:
    return tuple(float(value) for value in values)


def _note_fit(
    selected: Selected, estimates: Estimates, parameters: Sequence[PopulationParameter]
) -> list[str]:
    notes = []
    if not selected.variances.converged:
        notes.append("the search for the variances did not converge: the scatter is rough.")
    first = estimates.records[0]
    for p in parameters:
        low, high = first.bounds[:, first.names.index(p.name)]
        if p.mean.value - 3.0 * p.scatter < low or p.mean.value + 3.0 * p.scatter > high:
            notes.append(
                f"`{p.name}` scatters up to a bound of its fit: its distribution is not normal, "
                "and its intervals are rough."
            )
    return notes
