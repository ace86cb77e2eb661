"""Limits of a drive in a TOML file."""

from pathlib import Path

import pydantic
from pydantic import Field

from rapi_jax._errors import DataError
from rapi_jax._limits import DriveLimits
from rapi_jax.io._safe import StrPath, located, printable
from rapi_jax.io._toml import read_toml

_UM = {f"{name}_um{rest}": f"{name}_v{rest}" for name, rest in
       (("low", ""), ("high", ""), ("slew", "_per_s"), ("step", ""))}  # fmt: skip


class _Limits(pydantic.BaseModel):
    """V, V/s and Hz, in the names of the keys; of a drive in um, `_um` stands for `_v`."""

    model_config = pydantic.ConfigDict(extra="forbid", strict=True)

    low_v: float = Field(allow_inf_nan=False)
    high_v: float = Field(allow_inf_nan=False)
    slew_v_per_s: float = Field(gt=0, allow_inf_nan=False)
    step_v: float = Field(default=float("inf"), gt=0)
    max_frequency_hz: float = Field(default=float("inf"), gt=0)


def read_limits(path: StrPath) -> DriveLimits:
    """Read `low_v`, `high_v`, `slew_v_per_s` and, if wanted, `step_v`, `max_frequency_hz`.

    For a drive in um the keys are `low_um`, `high_um`, `slew_um_per_s` and `step_um`, and the
    limits are in um. They may stand in a table `limits`; those in the file of a bench are of the
    voltage at the piezo, behind an amplifier. Raises `DataError`, in one line, where one is
    missing, misspelt or not a number.

    >>> from rapi_jax.io import read_limits
    >>> with open("limits.toml", "w") as file:
    ...     for line in ("low_v = 0.0", "high_v = 7.0", "slew_v_per_s = 1000.0"):
    ...         print(line, file=file)
    >>> read_limits("limits.toml").high_v
    7.0
    """
    label = printable(path)
    table = read_toml(Path(path), label)
    with located(label):
        return limits_of(table.get("limits", table))


def limits_of(table: object) -> DriveLimits:
    """Limits from a table of their keys; raises `DataError` where it is not one."""
    unit = "V"
    if isinstance(table, dict) and not table.keys().isdisjoint(_UM):
        unit, table = "um", _in_volts(table)
    try:
        return DriveLimits(**_Limits.model_validate(table).model_dump(), unit=unit)
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"]) or "the table"
        raise DataError(
            f"`{printable(where, 40)}`: {printable(first['msg'], 120)}. Limits are low_v, high_v, "
            "slew_v_per_s and, if wanted, step_v and max_frequency_hz."
        ) from error
    except ValueError as error:
        raise DataError(printable(error, 200)) from error


def _in_volts(table: dict[str, object]) -> dict[str, object]:
    """A table of limits in um under the keys of those in V; `DataError` where it has both."""
    mixed = sorted(key for key in table if key in _UM.values())
    if mixed:
        raise DataError(
            f"`{mixed[0]}` is in V, but other limits of the file are in um. Give all of them in "
            "the unit of the drive."
        )
    return {_UM.get(key, key): value for key, value in table.items()}
