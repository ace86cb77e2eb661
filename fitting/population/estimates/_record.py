"""One recording's estimates: of a `FitResult`, or of the `model.json` that a fit wrote."""

import dataclasses
import json
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from fitting._result_files import UNFINISHED
from fitting.identification._content import SCHEMA
from fitting.identification._result import FitResult
from fitting.population._thresholds import THRESHOLDS
from rapi_jax import DataError
from rapi_jax.internal import parse_recorded_at, parse_temperature, read_text
from rapi_jax.io import printable

TABLE = "model.json"
_LIMIT = 64 * 2**20  # bytes
_ROUNDING = 1e3 * float(np.finfo(np.float64).eps)  # of an eigenvalue of a correlation matrix


@dataclasses.dataclass(frozen=True, eq=False)
class Record:
    """Estimates from one recording, as of its own fit.

    `structure`: what two fits must share to have the same parameters. `values`, `stderr`: in
    `units`; `correlation`: of them. `free`: whether each was estimated, and away from its bounds.
    """

    label: str
    structure: tuple[tuple[str, Any], ...]
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: np.ndarray
    stderr: np.ndarray
    correlation: np.ndarray
    held: np.ndarray
    at_bound: np.ndarray
    bounds: np.ndarray
    trusted: bool
    reasons: tuple[str, ...]
    recorded_at: datetime | None
    temperature_c: float | None
    sha256: str

    @property
    def free(self) -> np.ndarray:
        """Whether each parameter has an estimate with a standard error, away from its bounds."""
        known = np.isfinite(self.stderr) & (self.stderr > 0) & np.isfinite(self.values)
        return known & ~self.held & ~self.at_bound

    @property
    def covariance(self) -> np.ndarray:
        """Sampling covariance, `parameters parameters`; zero where there is no estimate."""
        error = np.where(self.free, self.stderr, 0.0)
        return self.correlation * np.outer(error, error)


def read_record(result: FitResult | Path, number: int) -> Record:
    """The record of a fit, or of the folder or `model.json` it was written to.

    `number`: its place in the list, the name of a result that has no folder. Raises `DataError`
    where the file is missing, unfinished, damaged or of another kind.
    """
    if isinstance(result, FitResult):
        return _of_table(result.to_dict(), f"result {number + 1}")
    path = result / TABLE if result.is_dir() else result
    label = printable(path)
    if not path.is_file():
        raise DataError(f"{label}: no such file. Give folders that `rapi fit` wrote.")
    name = printable(path.resolve().parent.name if path.name == TABLE else path.stem)
    try:
        table = json.loads(read_text(path, _LIMIT))
        schema = table["schema"]
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise DataError(
            f"{label}: not a result of `rapi fit`, or damaged. Fit its recording again."
        ) from error
    if schema == UNFINISHED:
        raise DataError(f"{label}: this fit was not written to its end. Fit again.")
    if schema != SCHEMA:
        raise DataError(f"{label}: schema {printable(schema, 60)}, not {SCHEMA}.")
    try:
        return dataclasses.replace(_of_table(table, name), label=name)
    except DataError as error:
        raise DataError(f"{label}: {error}") from error
    except (ValueError, KeyError, TypeError, AttributeError, IndexError) as error:
        raise DataError(
            f"{label}: damaged ({type(error).__name__}: {printable(error, 80)}). Fit its recording "
            "again."
        ) from error


def _of_table(table: dict[str, Any], label: str) -> Record:
    """The record in the content of a `model.json`, where a number that is not finite is null."""
    parameters: dict[str, dict[str, Any]] = table["parameters"]
    names = tuple(parameters)
    rows = list(parameters.values())
    bounds = [row.get("bounds") or (None, None) for row in rows]
    stderr = _numbers([row["stderr"] for row in rows], np.inf)
    verdict = table["verdict"]
    return Record(
        label=label,
        structure=_structure(table),
        names=names,
        units=tuple(str(row["unit"]) for row in rows),
        values=_numbers([row["value"] for row in rows], np.nan),
        stderr=stderr,
        correlation=_correlation(table["correlation"], names, np.isfinite(stderr) & (stderr > 0)),
        held=np.array([bool(row["held"]) for row in rows]),
        at_bound=np.array([bool(row["at_bound"]) for row in rows]),
        bounds=np.stack(
            [_numbers([b[0] for b in bounds], -np.inf), _numbers([b[1] for b in bounds], np.inf)]
        ),
        trusted=verdict["trusted"] is True,
        reasons=tuple(str(reason) for reason in verdict["reasons"]),
        recorded_at=parse_recorded_at(table.get("recorded_at")),
        temperature_c=parse_temperature(table.get("temperature_c")),
        sha256=str(table["data_sha256"]),
    )


def _structure(table: dict[str, Any]) -> tuple[tuple[str, Any], ...]:
    named = {
        "operator": table["operator"],
        "plays": table["plays"],
        "polynomial order": table["order"],
        "effects": ", ".join(table.get("effects") or ()) or "none",
        "unit of the response": table["unit"],
        "unit of the drive": table["drive_unit"],
    }
    return tuple(named.items())


def _numbers(values: list[Any], missing: float) -> np.ndarray:
    """Numbers, with `missing` in place of null."""
    return np.array([missing if value is None else float(value) for value in values])


def _correlation(table: dict[str, Any], names: tuple[str, ...], known: np.ndarray) -> np.ndarray:
    """Correlations of the parameters `names`; the file also has those of run offsets."""
    listed = [str(name) for name in table["names"]]
    matrix = np.array(table["matrix"], dtype=np.float64).reshape(len(listed), len(listed))
    out = np.eye(len(names))
    at = [i for i, name in enumerate(names) if known[i]]
    missing = [names[i] for i in at if names[i] not in listed]
    if missing:
        raise DataError(f"no correlation of `{missing[0]}` is given. Fit its recording again.")
    places = [listed.index(names[i]) for i in at]
    part = matrix[np.ix_(places, places)]
    good = np.all(np.isfinite(part)) and np.allclose(part, part.T, atol=1e-9)
    values, vectors = np.linalg.eigh(0.5 * (part + part.T)) if good else (np.array([-1.0]), part)
    if np.min(values, initial=1.0) < -THRESHOLDS.damaged_correlation:
        raise DataError("its correlations are no correlation matrix. Fit its recording again.")
    # What rounding made singular or negative is made positive, so that it has a Cholesky root.
    out[np.ix_(at, at)] = (vectors * np.maximum(values, _ROUNDING)) @ vectors.T
    return out
