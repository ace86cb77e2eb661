"""The content of `population.json`: plain numbers, lists and names, key by key."""

import dataclasses
from datetime import datetime
from typing import TYPE_CHECKING, Any

from fitting._json import replace_nonfinite
from fitting._versions import package_versions

from ._parameters import PopulationParameter
from ._recordings import PopulationRecording

if TYPE_CHECKING:
    from ._population import Population

SCHEMA = "rapi.population/1"


def population_content(population: "Population") -> dict[str, Any]:
    """Plain numbers and lists (schema `rapi.population/1`); not finite becomes `None`."""
    first = population.covariates.first
    return replace_nonfinite(
        {
            "schema": SCHEMA,
            "first": None if first is None else _iso(first),
            "covariates": {
                name: {"mean": mean, "standard_deviation": spread}
                for name, mean, spread in zip(
                    population.covariates.names,
                    population.covariates.means,
                    population.covariates.spreads,
                    strict=True,
                )
            },
            "parameters": {p.name: _parameter_dict(p) for p in population.parameters},
            "between": {
                "structure": population.structure,
                "names": list(population.names),
                "correlation": population.correlation.tolist(),
            },
            "smooth": _smooth_dict(population),
            "evidence": population.evidence,
            "recordings": [_recording_dict(one, population.names) for one in population.recordings],
            "outliers": [one.label for one in population.outliers],
            "left_out": [
                {"recording": label, "reason": reason} for label, reason in population.left_out
            ],
            "notes": list(population.notes),
            "versions": package_versions(),
        }
    )


def _smooth_dict(population: "Population") -> dict[str, Any] | None:
    curves, found = population.selected.curves, population.selected.variances
    if curves is None:
        return None
    spread = population.covariates.spreads[population.covariates.names.index("time")]
    return {
        "length_days": curves.length * spread,
        "amplitudes": {
            population.names[j]: float(amplitude * population.estimates.scale[j])
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
