"""What a population says of each parameter and each recording, from its fitted model."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from scipy import stats

from fitting._multiple_tests import adjust_holm

from ._parameters import Effect, PopulationParameter
from ._recordings import PopulationRecording
from .estimates._covariates import UNITS, Covariates
from .estimates._estimates import Estimates
from .variances._mixed_model import MixedModel
from .variances._selection import Selected


def summarise_parameters(
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
    plain = Effect(value, stderr, value - half, value + half, degrees, unit)
    return plain.times(float(factor), unit)


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


def summarise_recordings(
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


def note_fit(
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
