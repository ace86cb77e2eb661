"""An example of the options that a file asks for, in its own columns."""

import dataclasses
from typing import Any

from rapi_jax.io.imports._options import ImportOptions, MadeDrive
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import TIMES, known_unit

from ._clock_column import find_clock_columns
from ._command import column_key, import_command
from ._likely_columns import choose_column

_RATE_HZ = 10_000.0
_DRIVE = MadeDrive(amplitude=4.5, rate=10.0, offset=3.0)  # V peak to peak, Hz, V
_UNITS = {"drive": "V", "response": "GHz"}


def describe_example(
    path: str,
    tables: dict[str, Table],
    places: dict[str, int | None],
    options: ImportOptions,
    *,
    units: list[str],
    clock: bool,
    likely: dict[str, int],
) -> str:
    """The whole command, as an example, and what it supposes; empty where columns are too few.

    `tables`, `places`: of what is read, the place `None` where it is asked for; `units`: of what a
    unit is asked for, too. `clock`: whether a time is asked for. `likely`: columns by their units.
    """
    answers: dict[str, Any] = {}
    supposed: list[str] = []
    chosen: dict[str, int] = {}
    measured = options.measured
    taken = {(id(tables[what]), place) for what, place in places.items() if place is not None}
    if clock:
        found = find_clock_columns(tables[measured])
        answers |= _clock(tables[measured], found, supposed)
        taken |= {(id(tables[measured]), place) for place in found}
    for what in ("drive", measured, "cavity"):
        if what not in places or places[what] is not None:
            continue
        table = tables[what]
        free = [
            i
            for i, column in enumerate(table.columns)
            if not column.is_time
            and known_unit(column.unit or "") not in TIMES
            and (id(table), i) not in taken
        ]
        place = likely.get(what)
        if place is None:
            place = choose_column(what, table, free, places | chosen)
        if what == "drive" and len(free) == 1 and places.get(measured, 0) is None:
            if tables[measured] is table:  # the only column is what was measured
                answers["made"] = _DRIVE
                supposed.append("the drive was not recorded, but was a triangle of 10 Hz")
                continue
        if place is None:
            return ""
        taken.add((id(table), place))
        chosen[what] = place
        answers[what] = column_key(table, place)
        supposed.append(f"'{answers[what]}' is the {what}")
    answers |= {f"{what}_unit": _UNITS[what] for what in units}
    if "made" in answers and options.drive_unit is None:
        answers["drive_unit"] = "V"
    if measured == "fringes" and options.interferometer is None:
        answers["interferometer"] = "40.8 MHz"
    if options.cavity is not None and options.cavity_spacing is None:
        answers["cavity_spacing"] = "1.5 GHz"
    line = import_command([path], dataclasses.replace(options, **answers), "my-recording")
    *most, last = supposed or [""]
    where = f", if {', '.join(most)}{' and ' if most else ''}{last}" if last else ""
    return f"For example{where}: `{line}`."


def _clock(table: Table, found: list[int], supposed: list[str]) -> dict[str, Any]:
    if not found:
        return {"sample_rate": _RATE_HZ}
    key = column_key(table, found[0])
    supposed.append(f"'{key}', which rises evenly, is the time")
    return {"time": key}
