"""When and how warm: the covariates of each recording, standardised."""

import dataclasses
from collections.abc import Sequence
from datetime import datetime

import numpy as np
from jaxtyping import Float

from fitting.population._thresholds import THRESHOLDS
from rapi_jax import DataError, ModelError

from ._record import Record

COVARIATES = ("time", "temperature")
_KEYS = {
    "time": ("recorded_at", "recorded_at = 2026-11-24T10:00:00Z"),
    "temperature": ("temperature_c", "temperature_c = 21.3"),
}
UNITS = {"time": "day", "temperature": "K"}
DAY_S = 86400.0


@dataclasses.dataclass(frozen=True)
class Covariates:
    """The covariates `names` that are used: days since `first`, and deg C.

    `means`, `spreads`: of each over the recordings. A row is 1 and each covariate, standardised.
    """

    names: tuple[str, ...]
    first: datetime | None
    means: tuple[float, ...]
    spreads: tuple[float, ...]

    @property
    def count(self) -> int:
        """Fixed effects of each parameter: its mean, and one a covariate."""
        return 1 + len(self.names)

    def days(self, time: datetime) -> float:
        """Days since the first recording."""
        assert self.first is not None  # noqa: S101 (time is a covariate)
        return (time - self.first).total_seconds() / DAY_S

    def value(self, name: str, record: Record) -> float:
        """One covariate of a recording; raises `DataError` where it has none."""
        value = _value(name, record)
        if value is None:
            raise DataError(_missing(name, record.label))
        return self.days(value) if isinstance(value, datetime) else value

    def row(self, record: Record) -> np.ndarray:
        """The row of a recording; raises `DataError` where it lacks a covariate."""
        return self.row_at(*(self.value(name, record) for name in self.names))

    def row_at(self, *values: float) -> np.ndarray:
        """The row at these values of the covariates: days, deg C."""
        parts = zip(values, self.means, self.spreads, strict=True)
        return np.array([1.0, *((value - mean) / spread for value, mean, spread in parts)])


def _value(name: str, record: Record) -> datetime | float | None:
    return record.recorded_at if name == "time" else record.temperature_c


def _missing(name: str, label: str) -> str:
    key, example = _KEYS[name]
    return (
        f"{label}: no `{key}`. Write `{example}` at the top of its recording's manifest.toml and "
        f"fit again, or leave the covariate {name} out."
    )


def covariates_of(
    records: Sequence[Record], names: Sequence[str]
) -> tuple[Covariates, Float[np.ndarray, "recordings effects"], list[str]]:
    """The covariates that the recordings have of those asked for, their rows, and notes.

    One that no recording has, or that is the same in all, is left out with a note. Raises
    `DataError` where some have it and others not, or where two cannot be told apart.
    """
    unknown = [name for name in names if name not in COVARIATES]
    if unknown:
        raise ValueError(
            f"Argument `covariates` must be of {', '.join(COVARIATES)}, but has {unknown[0]!r}."
        )
    used, notes = [], []
    for name in COVARIATES:
        if name not in names:
            continue
        values = [_value(name, record) for record in records]
        if all(value is None for value in values):
            notes.append(f"no recording has `{_KEYS[name][0]}`: nothing is said of {name}.")
        elif None in values:
            raise DataError(_missing(name, records[values.index(None)].label))
        elif len(set(values)) == 1:
            notes.append(f"all recordings have the same {name}: nothing is said of it.")
        else:
            used.append(name)
    times = [record.recorded_at for record in records if record.recorded_at is not None]
    first = min(times) if len(times) == len(records) else None
    bare = Covariates(tuple(used), first, (), ())
    table = np.array([[bare.value(name, record) for name in used] for record in records])
    table = table.reshape(len(records), len(used))
    means, spreads = table.mean(axis=0), table.std(axis=0)
    found = dataclasses.replace(bare, means=tuple(means.tolist()), spreads=tuple(spreads.tolist()))
    rows = np.stack([found.row(record) for record in records])
    singular = np.linalg.svd(rows, compute_uv=False)
    if singular[-1] < THRESHOLDS.collinear * singular[0]:
        raise DataError(
            "time and temperature went together in all recordings, so their effects cannot be told "
            "apart. Leave one of the covariates out, or record at other temperatures."
        )
    return found, rows, notes


def check_units(count: int, effects: int, least: int) -> None:
    """Raise `ModelError` where recordings are too few for a scatter beside the fixed effects."""
    if count < effects + least:
        raise ModelError(
            f"{count} trusted fits are too few: at least {effects + least} are needed to tell "
            f"how the parameters scatter from one to the next beside {effects} coefficient(s) of "
            "each. Fit more recordings, or leave a covariate out (`--ignore`)."
        )
