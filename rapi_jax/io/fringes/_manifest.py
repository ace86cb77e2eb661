"""What a folder of fringe records says about itself, checked."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Literal

import pydantic
from pydantic import Field

from rapi_jax._errors import DataError
from rapi_jax.io._manifest_table import ManifestTable
from rapi_jax.io._safe import check_name, located, printable
from rapi_jax.io._toml import toml_value
from rapi_jax.ranging import AirState, FringeRecords

from ._array import CHANNELS

SCHEMA = "rapi.fringes/1"
WAVELENGTH_M = 780e-9  # the paper's laser
_NOTE = 500  # characters

_AIR = ("temperature_c", "pressure_pa", "relative_humidity")
_AIR_OPTIONS = (
    "co2_ppm", "temperature_stderr", "pressure_stderr", "humidity_stderr", "co2_stderr",
)  # fmt: skip
_CURES = {
    "schema": f'schema = "{SCHEMA}".',
    "sample_hz": "the digitizer's samples a second, such as sample_hz = 30e6.",
    "channels": 'the columns in their order, such as channels = ["measurement", "interferometer", '
    '"cavity"].',
    "interferometer_path_m": "the auxiliary interferometer's optical path difference in metres, "
    "which sets the scale of all distances.",
    "excitation_hz": "the rate of the scan in Hz.",
    "record": "one [[record]] table for each record, with its `file`.",
}


class RecordEntry(ManifestTable):
    """One `[[record]]`: `name` (default: the stem of `file`) is what outputs call it."""

    file: str
    name: str | None = None
    start_s: float | None = Field(default=None, allow_inf_nan=False)
    rising_at_start: bool | None = None


class FringeManifest(ManifestTable):
    """The head of fringe records; see `read_fringe_records`."""

    schema_: Literal["rapi.fringes/1"] = Field(alias="schema")
    sample_hz: float = Field(gt=0, allow_inf_nan=False)
    channels: list[str] = Field(min_length=2, max_length=64)
    volts_per_code: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    full_scale: list[float] | None = Field(default=None, min_length=2, max_length=2)
    interferometer_path_m: float = Field(gt=0, allow_inf_nan=False)
    cavity_spacing_hz: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    excitation_hz: float = Field(gt=0, allow_inf_nan=False)
    waveform: Literal["triangle", "sine", "multisine", "step", "other"] = "triangle"
    wavelength_m: float | None = Field(default=None, gt=0, allow_inf_nan=False)
    temperature_c: float | None = None
    pressure_pa: float | None = None
    relative_humidity: float | None = None
    co2_ppm: float | None = None
    temperature_stderr: float | None = None
    pressure_stderr: float | None = None
    humidity_stderr: float | None = None
    co2_stderr: float | None = None
    notes: Any = None
    record: list[RecordEntry] = Field(min_length=1, max_length=100_000)

    def columns(self) -> dict[str, int]:
        """Where each channel that is known stands. Raises `DataError`."""
        double = {name for name in self.channels if self.channels.count(name) > 1}
        if double:
            raise DataError(f"`channels`: '{printable(min(double), 40)}' is there twice.")
        for name in CHANNELS[:2]:
            if name not in self.channels:
                raise DataError(
                    f"`channels`: there is no '{name}' in "
                    f"{printable(ascii(self.channels), 120)}. Name the column that it is in."
                )
        return {name: self.channels.index(name) for name in CHANNELS if name in self.channels}

    def names(self) -> list[str]:
        """What each record is called. Raises `DataError` where one is there twice."""
        files = [entry.file for entry in self.record]
        names = [
            check_name(Path(entry.file).stem if entry.name is None else entry.name)
            for entry in self.record
        ]
        for what, several in (("file", files), ("name", names)):
            if len(set(several)) < len(several):
                double = next(one for one in several if several.count(one) > 1)
                raise DataError(f"`record`: the {what} '{printable(double, 60)}' is there twice.")
        return names

    def range(self) -> tuple[float, float] | None:
        """The digitizer's lowest and highest value. Raises `DataError` where they do not rise."""
        if self.full_scale is None:
            return None
        low, high = (float(x) for x in self.full_scale)
        if not low < high:
            raise DataError(f"`full_scale` = [{low:g}, {high:g}] must rise: lowest, then highest.")
        return low, high

    def air(self, notes: list[str]) -> AirState | None:
        """The state of the air, where it is all there; what is odd about it goes to `notes`."""
        given = [name for name in _AIR if getattr(self, name) is not None]
        if len(given) < len(_AIR):
            if given:
                lacking = ", ".join(name for name in _AIR if name not in given)
                notes.append(f"The index of air is taken as 1: {lacking} is missing.")
            return None
        fields = {name: getattr(self, name) for name in (*_AIR, *_AIR_OPTIONS)}
        if 1 < fields["relative_humidity"] <= 100:
            fields["relative_humidity"] /= 100
            notes.append(
                f"`relative_humidity` = {self.relative_humidity:g} is taken as a percentage: a "
                "fraction lies between 0 and 1."
            )
        return AirState(**{name: value for name, value in fields.items() if value is not None})

    def own_notes(self) -> list[str]:
        """The notes that were written with the records, and one for each value assumed."""
        written = self.notes if isinstance(self.notes, list) else [self.notes]
        notes = [printable(note, _NOTE) for note in written if isinstance(note, str)]
        if self.wavelength_m is None:
            notes.append(f"`wavelength_m` is missing: taken as {WAVELENGTH_M:g} m.")
        ignored = [printable(name, 40) for name in self.channels if name not in CHANNELS]
        if ignored:
            notes.append(f"Channels that are not read: {', '.join(ignored)}.")
        return notes


def parse_manifest(table: Mapping[str, Any]) -> FringeManifest:
    """The manifest in `table`. Raises `DataError` naming the first key that is wrong."""
    try:
        return FringeManifest.model_validate(dict(table))
    except pydantic.ValidationError as error:
        raise DataError(_explain(error.errors()[0], error.error_count() - 1)) from error


def _explain(first: Any, others: int) -> str:
    where = ".".join(printable(part, 40) for part in first["loc"])
    more = f" ({others} more such fault(s).)" if others else ""
    if where == "schema" and first["type"] != "missing":
        return f'`schema` must be "{SCHEMA}", but is {printable(ascii(first["input"]), 60)}.'
    if first["type"] == "missing":
        return f"`{where}` is missing: add {_CURES.get(where, 'it is required.')}{more}"
    said = printable(first["msg"].removeprefix("Value error, "))
    if isinstance(given := first.get("input"), str | int | float):
        said += f", but is {printable(ascii(given), 60)}"
    said = said if said.endswith("?") else f"{said}."
    return f"`{where}`: {said}{more}" if where else f"{said}{more}"


def manifest_text(
    about: FringeRecords, channels: list[str], entries: list[dict[str, Any]], notes: list[str]
) -> str:
    """The manifest of records whose entries are `entries`. Raises `DataError`."""
    whole: dict[str, Any] = {
        "schema": SCHEMA,
        "sample_hz": float(about.sample_hz),
        "channels": channels,
        "volts_per_code": float(about.volts_per_code),
        "full_scale": None if about.full_scale is None else [float(x) for x in about.full_scale],
        "interferometer_path_m": float(about.interferometer_path_m),
        "cavity_spacing_hz": about.cavity_spacing_hz,
        "excitation_hz": float(about.excitation_hz),
        "waveform": about.waveform,
        "wavelength_m": float(about.wavelength_m),
        "notes": [printable(note, _NOTE) for note in notes] or None,
    }
    if about.air is not None:
        whole |= {name: float(getattr(about.air, name)) for name in (*_AIR, *_AIR_OPTIONS)}
    tables = [
        {key: value for key, value in t.items() if value is not None} for t in (whole, *entries)
    ]
    for entry in entries:
        with located("a record"):
            check_name(entry["name"])
    parse_manifest(tables[0] | {"record": tables[1:]})
    lines = [f"{key} = {toml_value(value)}" for key, value in tables[0].items()]
    for entry in tables[1:]:
        lines += [
            "",
            "[[record]]",
            *(f"{key} = {toml_value(value)}" for key, value in entry.items()),
        ]
    return "\n".join(lines) + "\n"
