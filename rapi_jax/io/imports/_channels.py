"""Time, drive and response of one file, in the units of a recording and on one clock."""

import dataclasses
from pathlib import Path

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax.io._safe import printable
from rapi_jax.io.tables._read import read_table
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import (
    drive_factor,
    known_unit,
    response_factor,
    time_factor,
)

from ._clock import follow_clock, join_clocks
from ._made_drive import check_made, make_drive
from ._options import ImportOptions
from .columns._assumptions import describe_assumptions
from .columns._questions import locate_columns
from .columns._roles import Roles
from .columns._stated_units import other_units, refuse_temperature, time_column
from .fringes._read import check_fringes

ASSUMED = ", assumed)"  # of a time that has no unit
Samples = Float[np.ndarray, " samples"]


@dataclasses.dataclass(frozen=True, eq=False)
class Channels:
    """Samples of one file: time in s, drive and response in a recording's units.

    Of fringes, `response` is the interferometer's signal beside the `cavity`'s, in V of the file.
    `columns`: which columns they are, in words. `notes`: what was done and assumed.
    `time_assumed`: no unit of the time is said, and s is taken.
    """

    time: Samples
    drive: Samples
    response: Samples
    drive_unit: str
    response_unit: str
    columns: str
    notes: tuple[str, ...]
    recorded_at: str | None
    temperature_c: str | None
    cavity: Samples | None = None
    time_assumed: bool = False


def read_channels(table: Table, path: str, options: ImportOptions) -> Channels:
    """Read a table of a file as `options` say. Raises `DataError` that names what is missing."""
    short = printable(Path(path).name)
    notes = [f"{short}: {table.form}; columns {table.describe()}"]
    source = table if options.drive_file is None else read_table(options.drive_file)
    places = locate_columns(table, source, options, path)
    what = options.measured
    response_at = places[what]
    roles = Roles.of(table, path, options, places)
    roles.check_units()
    response, response_unit, said = _scaled(table, response_at, what, options)
    time, clock = _time_of(table, response_at, response.size, options)
    roles.check_time(time)
    notes += [f"{short}: {line}" for line in describe_assumptions(table, response_at, options)]
    notes += other_units(short, table, response_at, what, options)
    columns = [clock, f"{what}: {printable(table.columns[response_at].name, 40)} ({said})"]
    cavity = None
    if what == "fringes":
        check_fringes(table.label, what, response)
        if "cavity" in places:
            (cavity,) = table.load([places["cavity"]])
            check_fringes(table.label, "cavity", cavity)
            columns.append(f"cavity: {printable(table.columns[places['cavity']].name, 40)}")
    else:
        response = _settle(response, table, options)
    if options.made is not None:
        unit, factor = drive_factor(str(options.drive_unit))
        drive = factor * make_drive(options.made, time - time[0])
        turn = "whether it is, fringes do not say"
        if what == "response":
            try:
                turn = check_made(options.made, time - time[0], response)
            except DataError as error:
                raise DataError(f"{table.label}: {error}") from error
        made = options.made
        columns.insert(1, "drive: made")
        notes.append(
            f"{short}: no drive was recorded; assumed is a {made.waveform} at {made.rate:g} "
            f"Hz, {made.amplitude:g} {options.drive_unit} peak to peak centred on {made.offset:g}, "
            f"{made.phase:g} of a period after its minimum at the first sample; {turn}"
        )
        drive_unit = unit
    else:
        other_short = short
        if options.drive_file is not None:
            other_short = printable(Path(options.drive_file).name)
            notes.append(f"{other_short}: {source.form}; columns {source.describe()}")
        drive_at = places["drive"]
        drive, drive_unit, said = _scaled(source, drive_at, "drive", options)
        if source is table and drive_at == response_at:
            raise DataError(
                f"{table.label}: drive and {what} are the same column, "
                f"'{printable(table.columns[drive_at].name, 40)}'. Name another one."
            )
        _check_drive(drive, source)
        notes += other_units(other_short, source, drive_at, "drive", options)
        columns.insert(1, f"drive: {printable(source.columns[drive_at].name, 40)} ({said})")
        other, _ = _time_of(source, drive_at, drive.size, options)
        if other.size != time.size or not np.array_equal(other, time):
            try:
                if what == "fringes":
                    kept, drive, said = follow_clock((other, drive), time)
                    time, response = time[kept], response[kept]
                    cavity = None if cavity is None else cavity[kept]
                else:
                    time, drive, response, said = join_clocks((other, drive), (time, response))
            except DataError as error:
                raise DataError(f"{table.label}: {error}") from error
            notes.append(f"{short}: {said}")
        if what == "response":
            notes += [f"{other_short}: {line}" for line in roles.check_moving(drive, response)]
    warm = _temperature(table, options)
    return Channels(
        time, drive, response, drive_unit, response_unit, ", ".join(columns), tuple(notes),
        table.recorded_at, warm, cavity, clock.endswith(ASSUMED),
    )  # fmt: skip


def _scaled(
    table: Table, place: int, what: str, options: ImportOptions
) -> tuple[Samples, str, str]:
    """A column in the unit of a recording, that unit, and the conversion in words."""
    if what == "fringes":
        (values,) = table.load([place])
        return values, "GHz", f"interferometer: {printable(str(options.interferometer), 30)}"
    said = getattr(options, f"{what}_unit")
    scale = float(getattr(options, f"{what}_scale"))
    column = table.columns[place]
    unit = said if said is not None or scale != 1.0 else column.unit
    refuse_temperature(table, place, said, what)
    factor_of = drive_factor if what == "drive" else response_factor
    target, factor = factor_of(str(unit))
    unit = known_unit(str(unit)) or str(unit)
    (values,) = table.load([place])
    factor *= scale
    text = unit if unit == target else f"{unit} as {target}"
    text += f", times {scale:g}" if scale != 1.0 else ""
    text += "" if said is not None else ", the file's unit"
    return (values if factor == 1.0 else values * factor), target, text


def _time_of(table: Table, place: int, size: int, options: ImportOptions) -> tuple[Samples, str]:
    """Times of a column's samples, s, and where they are from."""
    column = table.columns[place]
    if options.sample_rate is not None:
        return np.arange(size) / options.sample_rate, f"time: {options.sample_rate:g} Hz, as said"
    at = time_column(table, options)
    if at == place and options.time is not None:
        raise DataError(
            f"{table.label}: --time and another column are the same, "
            f"'{printable(column.name, 40)}'. Name another one."
        )
    if at is not None and at != place:
        clock = table.columns[at]
        unit = options.time_unit or clock.unit or "s"
        (time,) = table.load([at])
        if time.size != size:
            raise DataError(
                f"{table.label}: '{printable(clock.name, 40)}' has {time.size} samples, but "
                f"'{printable(column.name, 40)}' has {size}. Choose another --time."
            )
        known = ")" if options.time_unit or clock.unit else ASSUMED
        name = printable(clock.name, 40)
        return time_factor(unit) * time, f"time: {name} ({known_unit(unit)}{known}"
    step = column.step_s or table.step_s
    if step is None:
        raise DataError(
            f"{table.label}: no column is a time. Name it by --time, or give --sample-rate. "
            f"Columns, by number or name: {table.describe()}."
        )
    return column.start_s + step * np.arange(size), f"time: every {step:g} s, by the header"


def _settle(response: Samples, table: Table, options: ImportOptions) -> Samples:
    bad = np.flatnonzero(~np.isfinite(response))
    if not bad.size:
        return response
    if options.nan == "raise":
        raise DataError(
            f"{table.label}: the response has {bad.size} reading(s) that are missing or beyond the "
            f"range, the first at {table.place(int(bad[0]))}. Readings are never interpolated: "
            "record again, or keep them as gaps by `--nan mask`."
        )
    return np.where(np.isfinite(response), response, np.nan)


def _check_drive(drive: Samples, table: Table) -> None:
    bad = np.flatnonzero(~np.isfinite(drive))
    if bad.size:
        raise DataError(
            f"{table.label}: the drive has {bad.size} value(s) that are missing or beyond the "
            f"range, the first at {table.place(int(bad[0]))}. A drive is never guessed: record "
            "again, or give what was sent by --drive-amplitude, --drive-offset and --drive-rate."
        )
    if not np.ptp(drive) > 0:
        raise DataError(
            f"{table.label}: the drive rests at {drive[0]:g}. Choose another --drive column, or "
            "give what was sent by --drive-amplitude, --drive-offset and --drive-rate."
        )


def _temperature(table: Table, options: ImportOptions) -> str | None:
    said = options.temperature_c
    if said is None:
        return None
    try:
        return f"{float(said):g}"
    except ValueError:
        (values,) = table.load([table.find(said, "--temperature")])
        return f"{float(np.nanmean(values)):.6g}"
