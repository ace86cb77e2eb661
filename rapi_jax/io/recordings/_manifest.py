"""What a recording says about itself, checked: the head of a folder and of a netCDF file alike."""

from collections.abc import Mapping
from typing import Any, Literal

import pydantic
from pydantic import Field

from rapi_jax._errors import DataError
from rapi_jax.io import _units
from rapi_jax.io._manifest_table import ManifestTable
from rapi_jax.io._safe import MAX_BYTES, check_name, printable
from rapi_jax.recording._drive import Waveform
from rapi_jax.recording._recording import Origin, Recording

SCHEMA = "rapi.recording/1"


class RunEntry(ManifestTable):
    """One `[[run]]`: `name` (default: the stem of `file`) is what outputs call the run.

    `samples`: how many its CSV file holds; written by this package, so that a cut file is refused.
    `missing_readings`: how many are missing on purpose; these are masked, and no others.
    """

    file: str
    name: str | None = None
    excitation_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    waveform: Waveform = "other"
    start_s: float = Field(default=0.0, allow_inf_nan=False)
    samples: int | None = Field(default=None, ge=0, le=MAX_BYTES)
    missing_readings: int = Field(default=0, ge=0, le=MAX_BYTES)


class Manifest(ManifestTable):
    """The head of a recording; see `read_recording`.

    `units_checked`: that the units are right, although the numbers look as if they were not; see
    `check_plausible`. Kept in the provenance.
    """

    schema_: Literal["rapi.recording/1"] = Field(alias="schema")
    response_unit: str
    drive_unit: str
    response_origin: Origin = "session"
    response_lag_s: float = Field(default=0.0, ge=0, allow_inf_nan=False)
    units_checked: bool | None = None
    run: list[RunEntry] = Field(min_length=1, max_length=10_000)
    provenance: dict[str, Any] = Field(default_factory=dict)

    def all_provenance(self, names: list[str]) -> dict[str, str]:
        """The provenance and every unknown key with one value, as text; `names`: of the runs."""
        found = _scalars(self.__pydantic_extra__ or {})
        for name, entry in zip(names, self.run, strict=True):
            extra = _scalars(entry.__pydantic_extra__ or {})
            found |= {f"{name}.{key}": text for key, text in extra.items()}
        if self.units_checked is not None:
            found[_units.UNITS_CHECKED] = str(self.units_checked).lower()
        return found | _scalars(self.provenance)


def _scalars(table: Mapping[str, Any]) -> dict[str, str]:
    return {k: str(v) for k, v in table.items() if not isinstance(v, dict | list)}


_FOREIGN = (
    "it names nothing that a recording does, so the folder is probably another "
    "program's: no recording. `rapi import FILE... -o my-recording` makes one from its files; a "
    f'manifest written by hand begins with schema = "{SCHEMA}".'
)


def parse_manifest(table: Mapping[str, Any]) -> Manifest:
    """The manifest in `table`. Raises `DataError` naming the first key that is wrong."""
    try:
        manifest = Manifest.model_validate(dict(table))
    except pydantic.ValidationError as error:
        known = {field.alias or name for name, field in Manifest.model_fields.items()}
        if table and not table.keys() & known:
            raise DataError(_FOREIGN) from error
        first = error.errors()[0]
        raise DataError(_explain(first, error.error_count() - 1)) from error
    _units.drive_unit(manifest.drive_unit)
    _units.response_unit(manifest.response_unit)
    return manifest


def _explain(first: Any, others: int) -> str:
    where = ".".join(printable(part, 40) for part in first["loc"])
    more = f" ({others} more such fault(s).)" if others else ""
    if where == "schema" and first["type"] != "missing":
        return f'`schema` must be "{SCHEMA}", but is {printable(ascii(first["input"]), 60)}.'
    if first["type"] == "missing":
        cure = {
            "schema": f'schema = "{SCHEMA}".',
            "response_unit": f"one of {', '.join(_units.RESPONSE_UNITS)}. No unit is assumed.",
            "drive_unit": f"one of {', '.join(_units.DRIVE_UNITS)}. No unit is assumed.",
            "run": "one [[run]] table for each run, with its `file`.",
        }.get(where, "it is required.")
        return f"`{where}` is missing: add {cure}{more}" if where else f"a key is missing.{more}"
    said = printable(first["msg"].removeprefix("Value error, "))
    if isinstance(given := first.get("input"), str | int | float):
        said += f", but is {printable(ascii(given), 60)}"
    said = said if said.endswith("?") else f"{said}."
    return f"`{where}`: {said}{more}" if where else f"{said}{more}"


Keys = dict[str, str | int | float]


def head(recording: Recording, *, masked: bool = False) -> tuple[Keys, list[Keys]]:
    """What to write of a recording beside its columns: of the whole, and of each run by `name`.

    `masked`: that readings are missing on purpose, and how many.
    """
    _units.drive_unit(recording.drive_unit)
    _units.response_unit(recording.response_unit)
    whole: Keys = {
        "schema": SCHEMA,
        "response_unit": recording.response_unit,
        "drive_unit": recording.drive_unit,
        "response_origin": recording.response_origin,
        "response_lag_s": float(recording.response_lag_s),
    }
    runs = []
    for run in recording.runs:
        drive = run.drive
        entry: Keys = {"name": check_name(run.name)}
        if drive.excitation_hz is not None:
            entry["excitation_hz"] = float(drive.excitation_hz)
        entry |= {"waveform": drive.waveform, "start_s": float(drive.start_s)}
        missing = int((~run.valid).sum()) if masked else 0
        runs.append(entry | ({"missing_readings": missing} if missing else {}))
    parse_manifest({**whole, "run": [{"file": "-", **entry} for entry in runs]})
    for text in (part for item in recording.provenance.items() for part in item):
        if not isinstance(text, str) or any("\ud800" <= c <= "\udfff" for c in text):
            raise DataError(f"`provenance` must be text, but has {ascii(text)[:60]}.")
    return whole, runs
