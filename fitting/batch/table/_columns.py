"""The columns of a batch's table: which there are, in which order, with which units."""

import dataclasses
from collections.abc import Iterable, Sequence

import numpy as np

from ._figures import Figure
from ._read import Result

FIRST = ("recording", "status", "exit_code", "trusted", "rmse", "rmse_held_out", "seconds")
DIAGNOSIS = ("verdict", "probability", "set")
LAST = "message"
_TASKS = {
    "fit": ("operator", "effects", "at_bound", "reasons", "with_gap")
    + ("claim_rms", "claim_low", "claim_high", "claim_noise"),
    "diagnose": ("operator", "gap_noise_floor", "gap_parametric", "gap_structural", "gap_before")
    + ("closed_fraction", "closed_fraction_low", "closed_fraction_high"),
    "compensate": ("operator", "drives", "span", "drive_min", "drive_max", "slew_max")
    + ("slope_min", "invertible", "nonlinearity_max", "expected_high", "inverse", "notes"),
    "range": ("scatter", "scans", "scans_counted", "method", "air_index"),
}
_COMMON = ("faults", "recorded_at", "temperature_c", "tries", "started_at", "data_sha256")
_RESPONSE = {"rmse", "rmse_held_out", "span", "nonlinearity_max", "expected_high", "gap_before"}
_RESPONSE |= {"claim_rms", "claim_low", "claim_high", "claim_noise", "scatter"}
_RESPONSE |= {"gap_noise_floor", "gap_parametric", "gap_structural"}
_UNITS = {"seconds": "s", "temperature_c": "degC", "probability": "1", "air_index": "1"}
_UNITS |= {f"closed_fraction{end}": "1" for end in ("", "_low", "_high")}


@dataclasses.dataclass(frozen=True)
class Column:
    """One column: a value per recording, None where there is none.

    `unit` is empty for text and counts, and where recordings differ in it. `estimated`: whether it
    is a parameter or its standard error.
    """

    name: str
    values: list[Figure]
    unit: str = ""
    estimated: bool = False


@dataclasses.dataclass(frozen=True)
class Parameter:
    """One parameter over all recordings, NaN where it is not known."""

    name: str
    unit: str
    value: np.ndarray
    stderr: np.ndarray


def tabulate(results: Sequence[Result]) -> tuple[list[Column], list[Parameter]]:
    """All columns in the order of `results.csv`, and the parameters among them.

    First what `contracts.md` fixes; figures of the tasks that occur stand between these and the
    message. Parameters come in the order in which they first occur, so that recordings fitted with
    different operators share one table.
    """
    parameters = _parameters(results)
    tasks = [one.record.task for one in results]
    names = list(FIRST)
    taken = {*FIRST, *DIAGNOSIS, LAST, *_COMMON, "unit", "drive_unit", "task", "path"}
    taken |= {name for group in _TASKS.values() for name in group}
    columns = [Column(name, _values(results, name), _unit(results, name)) for name in names]
    for one in parameters:
        heads = (one.name, f"{one.name}_stderr")
        if taken & set(heads):
            heads = tuple(f"parameter.{head}" for head in heads)
        for head, values in zip(heads, (one.value, one.stderr), strict=True):
            columns.append(Column(head, [_finite(x) for x in values.tolist()], one.unit, True))
    rest = ["task", "path", "unit", "drive_unit"]
    rest += [name for task, group in _TASKS.items() if task in tasks for name in group]
    if "diagnose" in tasks:
        rest = [*DIAGNOSIS, *rest]
    for name in dict.fromkeys([*rest, *_COMMON, LAST]):
        columns.append(Column(name, _values(results, name), _unit(results, name)))
    return columns, parameters


def _values(results: Sequence[Result], name: str) -> list[Figure]:
    if name in ("status", "exit_code", "seconds", "task", "tries", "started_at"):
        return [getattr(one.record, name) for one in results]
    if name in ("recording", "path"):
        key = {"recording": "name", "path": "recording"}[name]
        return [getattr(one.record, key) for one in results]
    if name == LAST:
        return [one.message for one in results]
    return [one.row.figures.get(name) for one in results]


def _unit(results: Sequence[Result], name: str) -> str:
    if name in _RESPONSE:
        return _only(one.row.figures.get("unit") for one in results)
    if name in ("drive_min", "drive_max", "slew_max", "slope_min"):
        drive = _only(one.row.figures.get("drive_unit") for one in results)
        response = _only(one.row.figures.get("unit") for one in results)
        if name == "slope_min":
            return f"{response}/{drive}" if response and drive else ""
        return f"{drive}/s" if drive and name == "slew_max" else drive
    return _UNITS.get(name, "")


def _only(units: Iterable[Figure]) -> str:
    """The unit that all have which have any."""
    known = {str(unit) for unit in units if unit}
    return known.pop() if len(known) == 1 else ""


def _parameters(results: Sequence[Result]) -> list[Parameter]:
    found: dict[str, tuple[set[str], np.ndarray, np.ndarray]] = {}
    for i, one in enumerate(results):
        for name, estimate in one.row.estimates.items():
            if name not in found:
                value, stderr = np.full((2, len(results)), np.nan)
                found[name] = (set(), value, stderr)
            units, value, stderr = found[name]
            units.add(estimate.unit)
            value[i], stderr[i] = estimate.value, estimate.stderr
    return [
        Parameter(name, _only(units), value, stderr)
        for name, (units, value, stderr) in found.items()
    ]


def _finite(x: float) -> float | None:
    return x if np.isfinite(x) else None
