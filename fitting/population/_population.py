"""A population of recordings of one device: means, drift, scatter, and what each recording says."""

import dataclasses
import os
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from ._content import population_content
from ._parameters import PopulationParameter
from ._recordings import PopulationRecording
from .estimates._covariates import Covariates
from .estimates._estimates import Estimates
from .estimates._record import Record
from .variances._mixed_model import MixedModel
from .variances._selection import Selected


@dataclasses.dataclass(frozen=True, eq=False)
class Expectation:
    """What is expected at some time and temperature, in the order of the parameters.

    `stderr`: of `values`. `spread`: standard deviation of a recording without errors of its own.
    """

    values: Float[np.ndarray, " parameters"]
    stderr: Float[np.ndarray, " parameters"]
    spread: Float[np.ndarray, " parameters"]


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
        return population_content(self)
