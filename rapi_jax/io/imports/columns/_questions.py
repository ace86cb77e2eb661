"""What a file leaves open and options must say, asked at once."""

import shlex

from rapi_jax.io._safe import printable
from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.imports.fringes._optics import CAVITY_EXAMPLE, INTERFEROMETER_EXAMPLES
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import DRIVES, RESPONSES, known_unit

from ._command import column_key
from ._example import describe_example
from ._open_question import OpenQuestion
from ._stated_units import time_column

_ALLOWED = {"drive": DRIVES, "response": RESPONSES}


def locate_columns(
    table: Table, source: Table, options: ImportOptions, path: str
) -> dict[str, int]:
    """The columns of the response or of fringes, in `table`, and of a recorded drive, in `source`.

    Raises `OpenQuestion`, with one question for all columns, units and clocks that neither files
    nor options give, the options that answer it, and an example for the file `path`.
    """
    measured = options.measured
    tables = {measured: table} | ({"drive": source} if options.made is None else {})
    tables |= {"cavity": table} if options.cavity is not None else {}
    _find_named(table, [what for what, one in tables.items() if one is table], options)
    places = {what: _place(one, what, options) for what, one in tables.items()}
    columns = [what for what, place in places.items() if place is None]
    units = [what for what in (measured, "drive") if not _has_unit(tables, what, options)]
    optics = _ask_optics(options)
    clocks = _ask_clock(tables, places, measured, options)
    if not columns and not units and not optics and not clocks:
        return {what: place for what, place in places.items() if place is not None}
    parts, likely = [], _by_units(tables, columns)
    if columns:
        which = "which column is the " if len(columns) == 1 else "which columns are the "
        parts.append(
            f"{which}{' and the '.join(columns)}? Name {_options(columns)}"
            f"{_name_likely(tables, likely)}."
        )
        parts += [] if clocks else _say_time(table, options)
    if units:
        verb = "is" if len(units) == 1 else "are"
        noun = "unit" if len(units) == 1 else "units"
        parts.append(
            f"the {noun} of the {' and the '.join(units)} {verb} not known. Give "
            f"{' and '.join(f'--{what}-unit' for what in units)}; no unit is assumed."
        )
    parts += clocks + optics
    there = {one.label: one for one in (table, source) if columns or clocks}
    lists = [
        (f"Columns of {label}" if len(there) > 1 else "Columns")
        + f", by number or name: {one.describe(values=True)}."
        for label, one in there.items()
    ]
    example = describe_example(
        path, tables, places, options, units=units, clock=bool(clocks), likely=likely
    )
    lists += [example] if example else []
    lists += [f"--{what}-unit is one of {', '.join(_ALLOWED[what])}." for what in units]
    text = " ".join([parts[0], *(part[0].upper() + part[1:] for part in parts[1:]), *lists])
    raise OpenQuestion(f"{table.label}: {text}")


def _find_named(table: Table, columns: list[str], options: ImportOptions) -> None:
    """Raise one `DataError` for all names that options give and `table` does not hold."""
    keys = {f"--{what}": getattr(options, what) for what in [*columns, "time"]}
    table.find_each({option: key for option, key in keys.items() if key is not None})


def _place(table: Table, what: str, options: ImportOptions) -> int | None:
    """The column that is named, or else the one that is called `what`."""
    key = getattr(options, what)
    if key is not None:
        return table.find(key, f"--{what}")
    named = [i for i, c in enumerate(table.columns) if what in [n.lower() for n in c.names]]
    return named[0] if len(named) == 1 else None


def _by_units(tables: dict[str, Table], columns: list[str]) -> dict[str, int]:
    """The only columns whose units are those of a drive and of a response.

    Empty where units do not tell. A voltage may be a response, too: only where it is no drive.
    """
    found: dict[str, int] = {}
    for what in columns if len(columns) > 1 else ():
        if what not in _ALLOWED:
            return {}
        told = [
            (place, known_unit(column.unit or ""))
            for place, column in enumerate(tables[what].columns)
            if not column.is_time
        ]
        volts = [place for place, unit in told if unit in DRIVES and DRIVES[unit][0] == "V"]
        others = [place for place, unit in told if unit in RESPONSES and place not in volts]
        likely = volts if what == "drive" else others
        if len(likely) != 1:
            return {}
        found[what] = likely[0]
    return found


def _name_likely(tables: dict[str, Table], likely: dict[str, int]) -> str:
    words = [f"--{what} {shlex.quote(column_key(tables[what], at))}" for what, at in likely.items()]
    return f", by their units `{' '.join(words)}`" if words else ""


def _say_time(table: Table, options: ImportOptions) -> list[str]:
    """Which column is taken as the time, where one is."""
    if options.sample_rate is not None or (at := time_column(table, options)) is None:
        return []
    return [f"the time is column '{printable(column_key(table, at), 40)}'."]


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
            "the change of optical frequency a fringe is not known: give --interferometer, such as "
            f"{INTERFEROMETER_EXAMPLES}."
        )
    if options.cavity is not None and options.cavity_spacing is None:
        asked.append(
            f"give the cavity's free spectral range by --cavity-spacing, such as {CAVITY_EXAMPLE}."
        )
    return asked
