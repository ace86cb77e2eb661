"""What a file leaves open and options must say, asked at once."""

import shlex

from rapi_jax._errors import DataError
from rapi_jax.io._safe import printable
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import DRIVES, RESPONSES, known_unit

from ._options import ImportOptions
from .fringes._optics import CAVITY_EXAMPLE, INTERFEROMETER_EXAMPLES

_ALLOWED = {"drive": DRIVES, "response": RESPONSES}


def locate_columns(table: Table, source: Table, options: ImportOptions) -> dict[str, int]:
    """The columns of the response or of fringes, in `table`, and of a recorded drive, in `source`.

    Raises `DataError`, with one question for all columns, units and clocks that neither files nor
    options give, and the options that answer it.
    """
    measured = options.measured
    tables = {measured: table} | ({"drive": source} if options.made is None else {})
    tables |= {"cavity": table} if options.cavity is not None else {}
    places = {what: _place(one, what, options) for what, one in tables.items()}
    columns = [what for what, place in places.items() if place is None]
    units = [what for what in (measured, "drive") if not _has_unit(tables, what, options)]
    optics = _ask_optics(options)
    clocks = _ask_clock(tables, places, measured, options)
    if not columns and not units and not optics and not clocks:
        return {what: place for what, place in places.items() if place is not None}
    parts = []
    if columns:
        which = "which column is the " if len(columns) == 1 else "which columns are the "
        likely = _by_units(tables, columns)
        parts.append(f"{which}{' and the '.join(columns)}? Name {_options(columns)}{likely}.")
    if units:
        verb = "is" if len(units) == 1 else "are"
        noun = "unit" if len(units) == 1 else "units"
        choices = (f"--{what}-unit is one of {', '.join(_ALLOWED[what])}" for what in units)
        parts.append(
            f"the {noun} of the {' and the '.join(units)} {verb} not known. Give "
            f"{' and '.join(f'--{what}-unit' for what in units)}; no unit is assumed "
            f"({'; '.join(choices)})."
        )
    parts += clocks + optics
    there = {one.label: one for one in (table, source) if columns or clocks}
    lists = [
        (f"Columns of {label}" if len(there) > 1 else "Columns")
        + f", by number or name: {one.describe(values=True)}."
        for label, one in there.items()
    ]
    text = " ".join([parts[0], *(part[0].upper() + part[1:] for part in parts[1:]), *lists])
    raise DataError(f"{table.label}: {text}")


def _place(table: Table, what: str, options: ImportOptions) -> int | None:
    """The column that is named, or else the one that is called `what`."""
    key = getattr(options, what)
    if key is not None:
        return table.find(key, f"--{what}")
    named = [i for i, c in enumerate(table.columns) if what in [n.lower() for n in c.names]]
    return named[0] if len(named) == 1 else None


def _by_units(tables: dict[str, Table], columns: list[str]) -> str:
    """The options with the only columns whose units are those of a drive and of a response.

    Empty where units do not tell. A voltage may be a response, too: only where it is no drive.
    """
    found: dict[str, str] = {}
    for what in columns:
        if what not in _ALLOWED:
            return ""
        told = [
            (column.bare or column.name, known_unit(column.unit or ""))
            for column in tables[what].columns
            if not column.is_time
        ]
        volts = [name for name, unit in told if unit in DRIVES and DRIVES[unit][0] == "V"]
        others = [name for name, unit in told if unit in RESPONSES and name not in volts]
        likely = volts if what == "drive" else others
        if len(likely) != 1:
            return ""
        found[what] = likely[0]
    words = " ".join(f"--{what} {shlex.quote(printable(name))}" for what, name in found.items())
    return f", by their units `{words}`" if len(found) == len(columns) > 1 else ""


def _has_unit(tables: dict[str, Table], what: str, options: ImportOptions) -> bool:
    """Whether a unit is said, or the file may say one: of a column not named yet, any has one."""
    if what == "fringes":
        return True
    if getattr(options, f"{what}_unit") is not None:
        return True
    if what not in tables or getattr(options, f"{what}_scale") != 1.0:
        return False
    table = tables[what]
    place = _place(table, what, options)
    asked = table.columns if place is None else [table.columns[place]]
    return any(column.unit for column in asked if place is not None or not column.is_time)


def _ask_clock(
    tables: dict[str, Table], places: dict[str, int | None], measured: str, options: ImportOptions
) -> list[str]:
    """What is to be said of the times of the response and of the drive."""
    if options.sample_rate is not None or options.time is not None:
        return []
    asked = [what for what in (measured, "drive") if what in tables]
    silent = [what for what in asked if not _has_clock(tables[what], places[what])]
    labels = list(dict.fromkeys(tables[what].label for what in silent))
    if not labels:
        return []
    where = f" of {' and of '.join(labels)}" if len({t.label for t in tables.values()}) > 1 else ""
    return [f"no column{where} is a time. Name it by --time, or give --sample-rate."]


def _has_clock(table: Table, place: int | None) -> bool:
    """Whether a file says when a column was sampled: of one not named yet, any column counts."""
    if table.step_s is not None or table.find_time() is not None:
        return True
    asked = table.columns if place is None else [table.columns[place]]
    return any(column.step_s is not None for column in asked)


def _options(columns: list[str]) -> str:
    if len(columns) == 1:
        return f"it by --{columns[0]}"
    return f"them by {' and '.join(f'--{what}' for what in columns)}"


def _ask_optics(options: ImportOptions) -> list[str]:
    """What is to be said of an interferometer and a cavity."""
    asked = []
    if options.fringes is not None and options.interferometer is None:
        asked.append(
            f"one fringe is so many GHz: give --interferometer, such as {INTERFEROMETER_EXAMPLES}."
        )
    if options.cavity is not None and options.cavity_spacing is None:
        asked.append(
            f"give the cavity's free spectral range by --cavity-spacing, such as {CAVITY_EXAMPLE}."
        )
    return asked
