"""A population of recordings of one device: means, drift, scatter, and what each recording says."""

import dataclasses
import os
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from fitting._json import replace_nonfinite
from fitting._versions import package_versions
from rapi_jax import ModelError

from .estimates._covariates import Covariates
from .estimates._estimates import Estimates
from .estimates._record import Record
from .variances._mixed_model import MixedModel
from .variances._selection import Selected

SCHEMA = "rapi.population/1"
YEAR_DAYS = 365.25


@dataclasses.dataclass(frozen=True)
class Effect:
    """A coefficient of one parameter, with its standard error and confidence interval.

    By Student's t with `degrees` of freedom (Kenward and Roger). `p_value`: of being 0; `p_holm`:
    the same for all parameters together; not a number for a mean.
    """

    value: float
    stderr: float
    low: float
    high: float
    degrees: float
    unit: str
    p_value: float = float("nan")
    p_holm: float = float("nan")

    def times(self, factor: float, unit: str) -> "Effect":
        """The same in another unit."""
        scaled = {key: factor * getattr(self, key) for key in ("value", "stderr", "low", "high")}
        return dataclasses.replace(self, **scaled, unit=unit)


@dataclasses.dataclass(frozen=True)
class PopulationParameter:
    """One parameter over all recordings.

    - `mean`: at the mean time and temperature of the recordings.
    - `time`, `temperature`: change a day and a kelvin; `None` where that is no covariate. Where
      `smooth`, a smooth curve is added to the line in time.
    - `scatter`: standard deviation between recordings beyond the errors of their own fits, with its
      95 % interval.
    """

    name: str
    unit: str
    mean: Effect
    time: Effect | None
    temperature: Effect | None
    scatter: float
    scatter_low: float
    scatter_high: float
    smooth: bool

    @property
    def per_year(self) -> Effect | None:
        """The drift in a year."""
        if self.time is None:
            return None
        return self.time.times(YEAR_DAYS, self.time.unit.replace("/day", "/year"))


@dataclasses.dataclass(frozen=True, eq=False)
class Expectation:
    """What is expected at some time and temperature, in the order of the parameters.

    `stderr`: of `values`. `spread`: standard deviation of a recording without errors of its own.
    """

    values: Float[np.ndarray, " parameters"]
    stderr: Float[np.ndarray, " parameters"]
    spread: Float[np.ndarray, " parameters"]


@dataclasses.dataclass(frozen=True)
class PopulationRecording:
    """One recording in the population; arrays are of its parameters, NaN where not estimated.

    - `days`: since the first; `None` where time is not known.
    - `values`, `stderr`: of its own fit. `shrunken`, `shrunken_stderr`: its empirical Bayes
      estimates, from its own fit and the population.
    - `p_value`: of the recording in the prediction of the others, `p_holm` for all recordings
      together. An `outlier` is no part of means, drift and scatter.
    """

    label: str
    recorded_at: datetime | None
    days: float | None
    temperature_c: float | None
    values: tuple[float, ...]
    stderr: tuple[float, ...]
    shrunken: tuple[float, ...]
    shrunken_stderr: tuple[float, ...]
    p_value: float
    p_holm: float
    outlier: bool
    sha256: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Population:
    """Many recordings of one device; see `fit_population`.

    - `parameters`, `recordings`: in the order of the first fit, and of time.
    - `left_out`: labels of recordings that were not used, and why.
    - `structure` of the covariance between recordings, `correlation`: of it.
    - `evidence`: log evidence of each variance model that was tried, less that of the best.

    >>> from fitting import fit, fit_population
    >>> from rapi_jax.examples import paper_device, paper_recording
    >>> days = [paper_recording(samples=400, periods=2, seed=k)[0] for k in range(5)]
    >>> fits = [fit(paper_device(), day, starts=2, hold_out=False) for day in days]
    >>> population = fit_population(fits)
    >>> len(population.recordings), population.outliers
    (5, ())
    >>> scatter = population["alpha"].scatter_high  # at most, between recordings
    >>> scatter < 1e-3
    True
    """

    parameters: tuple[PopulationParameter, ...]
    recordings: tuple[PopulationRecording, ...]
    left_out: tuple[tuple[str, str], ...]
    notes: tuple[str, ...]
    structure: str
    correlation: np.ndarray
    evidence: dict[str, float]
    estimates: Estimates
    covariates: Covariates
    selected: Selected
    model: MixedModel

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return self.estimates.names

    @property
    def outliers(self) -> tuple[PopulationRecording, ...]:
        """Recordings that are not of the population."""
        return tuple(one for one in self.recordings if one.outlier)

    def __getitem__(self, name: str) -> PopulationParameter:
        """The parameter `name`."""
        for parameter in self.parameters:
            if parameter.name == name:
                return parameter
        raise KeyError(f"no parameter {name!r}; there are {', '.join(self.names)}")

    def expectation(
        self, *, days: float | None = None, temperature_c: float | None = None
    ) -> "Expectation":
        """What a recording's parameters are expected to be.

        `days`: since the first recording, `temperature_c`: deg C; by default the means over the
        recordings.
        """
        given = {"time": days, "temperature": temperature_c}
        means = dict(zip(self.covariates.names, self.covariates.means, strict=True))
        values = [
            means[name] if value is None else value
            for name, value in given.items()
            if name in means
        ]
        design, rest = self._design(self.covariates.row_at(*values))
        scale = self.estimates.scale
        own = np.diag(design @ self.model.corrected_covariance @ design.T) + rest
        total = own + np.diag(self.model.between)
        return Expectation(
            scale * (design @ self.model.coefficients), scale * np.sqrt(own), scale * np.sqrt(total)
        )

    def design_of(self, record: Record) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients to the expectation of a recording, and the variance that they leave."""
        return self._design(self.covariates.row(record))

    def _design(self, row: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The same from a row of standardised covariates."""
        rest = np.zeros(self.estimates.size)
        curves = self.selected.curves
        if curves is None:
            return self.selected.design(row, None), rest
        functions, left = curves.at(float(row[1 + self.covariates.names.index("time")]))
        found = self.selected.variances
        rest[list(found.smooth)] = left * found.amplitudes**2
        return self.selected.design(row, functions), rest

    def excludes(self, sha256: str) -> bool:
        """Whether the recording with this hash has no part in means, drift and scatter."""
        return all(one.sha256 != sha256 or one.outlier for one in self.recordings)

    def summary(self) -> str:
        """The population as text for people."""
        from fitting.report.population._terminal import render_text

        return render_text(self)

    def __str__(self) -> str:
        return self.summary()

    def __repr__(self) -> str:
        return (
            f"<Population: {len(self.recordings)} recordings, {len(self.parameters)} parameters, "
            f"{len(self.outliers)} outlier(s)>"
        )

    def save(self, folder: str | os.PathLike[str], *, plots: bool = True) -> list[Path]:
        """Write `population.json` and `population.png` to `folder`; return their paths."""
        from fitting.report.population._files import write_population

        path = Path(folder)
        path.mkdir(parents=True, exist_ok=True)
        return write_population(self, path, plots=plots)

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers and lists (schema `rapi.population/1`); not finite becomes `None`."""
        first = self.covariates.first
        return replace_nonfinite(
            {
                "schema": SCHEMA,
                "first": None if first is None else _iso(first),
                "covariates": {
                    name: {"mean": mean, "standard_deviation": spread}
                    for name, mean, spread in zip(
                        self.covariates.names,
                        self.covariates.means,
                        self.covariates.spreads,
                        strict=True,
                    )
                },
                "parameters": {p.name: _parameter_dict(p) for p in self.parameters},
                "between": {
                    "structure": self.structure,
                    "names": list(self.names),
                    "correlation": self.correlation.tolist(),
                },
                "smooth": self._smooth_dict(),
                "evidence": self.evidence,
                "recordings": [_recording_dict(one, self.names) for one in self.recordings],
                "outliers": [one.label for one in self.outliers],
                "left_out": [
                    {"recording": label, "reason": reason} for label, reason in self.left_out
                ],
                "notes": list(self.notes),
                "versions": package_versions(),
            }
        )

    def _smooth_dict(self) -> dict[str, Any] | None:
        curves, found = self.selected.curves, self.selected.variances
        if curves is None:
            return None
        spread = self.covariates.spreads[self.covariates.names.index("time")]
        return {
            "length_days": curves.length * spread,
            "amplitudes": {
                self.names[j]: float(amplitude * self.estimates.scale[j])
                for j, amplitude in zip(found.smooth, found.amplitudes, strict=True)
            },
        }


def _iso(time: datetime) -> str:
    return time.isoformat().replace("+00:00", "Z")


def _parameter_dict(p: PopulationParameter) -> dict[str, Any]:
    return {
        "unit": p.unit,
        "mean": dataclasses.asdict(p.mean),
        "per_day": None if p.time is None else dataclasses.asdict(p.time),
        "per_year": None if p.per_year is None else dataclasses.asdict(p.per_year),
        "per_kelvin": None if p.temperature is None else dataclasses.asdict(p.temperature),
        "scatter": {"value": p.scatter, "low": p.scatter_low, "high": p.scatter_high},
        "smooth": p.smooth,
    }


def _recording_dict(one: PopulationRecording, names: tuple[str, ...]) -> dict[str, Any]:
    table = dataclasses.asdict(one)
    columns = ("values", "stderr", "shrunken", "shrunken_stderr")
    arrays = {key: table.pop(key) for key in columns}
    time = table.pop("recorded_at")
    return table | {
        "recorded_at": None if time is None else _iso(time),
        "parameters": {
            name: dict(
                zip(
                    ("value", "stderr", "shrunken", "shrunken_stderr"),
                    (arrays[key][j] for key in columns),
                    strict=True,
                )
            )
            for j, name in enumerate(names)
        },
    }


def check_units(count: int, effects: int, least: int) -> None:
    """Raise `ModelError` where recordings are too few for a scatter beside the fixed effects."""
    if count < effects + least:
        raise ModelError(
            f"{count} trusted recording(s), but {effects + least} are the least for {effects} "
            "coefficient(s) a parameter and a scatter between recordings. Record more, or leave a "
            "covariate out."
        )
