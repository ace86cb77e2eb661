"""`fit_population`: a hierarchical fit over many recordings of one device."""

import collections
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from fitting.identification._result import FitResult
from rapi_jax.internal import float64, takes
from rapi_jax.io import printable

from ._outliers import leave_one_out, worst
from ._population import Population
from ._summary import note_fit, summarise_parameters, summarise_recordings
from ._thresholds import THRESHOLDS
from .estimates._covariates import COVARIATES, check_units, covariates_of
from .estimates._estimates import LEFT_OUT, Estimates, gather
from .estimates._record import Record, read_record
from .variances._selection import STRUCTURES, Selected, select


@takes(results=[FitResult | Path])
@float64
def fit_population(
    results: Sequence[FitResult | Path],
    *,
    covariates: Sequence[str] = COVARIATES,
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
      parameter, which takes minutes with ten) or "auto": smooth in those parameters where that has
      more evidence.
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

    >>> from fitting import fit, fit_population
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> days = [paper_recording(samples=400, periods=2, seed=k)[0] for k in range(5)]
    >>> fits = [fit(paper_device(), day, starts=2, hold_out=False) for day in days]
    >>> population = fit_population(fits)
    >>> round(population["lam"].mean.value, 3)
    1.6
    """
    _check_arguments(drift, structure, level)
    records, left_out = _read(results)
    return fit_records(
        records, left_out, covariates=covariates, drift=drift, structure=structure,
        without=without, keep_outliers=keep_outliers, level=level,
    )  # fmt: skip


def fit_records(
    records: Sequence[Record],
    left_out: Sequence[tuple[str, str]] = (),
    *,
    covariates: Sequence[str] = COVARIATES,
    drift: str = "auto",
    structure: str = "auto",
    without: Sequence[str] = LEFT_OUT,
    keep_outliers: bool = False,
    level: float = 0.95,
) -> Population:
    """The population of records that are trusted, in their order; see `fit_population`."""
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
    parameters = summarise_parameters(estimates, chosen, selected, model, level)
    notes += more + note_fit(selected, estimates, parameters)
    scatter = np.sqrt(np.diag(model.between))
    size = np.outer(scatter, scatter)
    correlation = np.where(size > 0, model.between / np.where(size > 0, size, 1.0), 0.0)
    np.fill_diagonal(correlation, 1.0)
    return Population(
        parameters=parameters,
        recordings=summarise_recordings(estimates, chosen, model, p_values),
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
    labels = collections.Counter(record.label for record in read)
    read = [  # folders of one name are told apart by their paths
        dataclasses.replace(record, label=printable(result))
        if labels[record.label] > 1 and isinstance(result, Path)
        else record
        for record, result in zip(read, results, strict=True)
    ]
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
