"""Units that a file states beside those of options, and what looks like another quantity."""

import re

from rapi_jax._errors import DataError
from rapi_jax.io._safe import printable
from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import known_unit

_TEMPERATURE = re.compile(r"temp(?!l)|thermo|celsius|\bt_?c\b", re.IGNORECASE)


def other_units(
    short: str, table: Table, place: int, what: str, options: ImportOptions
) -> list[str]:
    """Where an option names another unit than the file: which is used, and what undoes it.

    Of the column `place`, which is `what`, and of the time beside a response. A factor of its own
    (such as `--drive-scale`) makes another unit, and needs no word.
    """
    found = []
    if what != "fringes" and getattr(options, f"{what}_scale") == 1.0:
        found.append((place, what, getattr(options, f"{what}_unit")))
    if what != "drive" and options.sample_rate is None:
        found.append((time_column(table, options), "time", options.time_unit))
    notes = []
    for at, name, said in found:
        stated = None if at is None else table.columns[at].unit
        if at is None or said is None or stated is None:
            continue
        if (known_unit(stated) or stated) != (known_unit(said) or said):
            column = printable(table.columns[at].name, 40)
            notes.append(
                f"{short}: the file says {printable(stated, 12)} for the {name} (column "
                f"'{column}'), --{name}-unit says {printable(said, 12)}, which is used. If the "
                f"file is right, leave --{name}-unit out"
            )
    return notes


def refuse_temperature(table: Table, place: int, said: str | None, what: str) -> None:
    """Refuse a column that is named like a temperature, and whose C is read as coulombs.

    `said`: the unit that an option names, which stays in force.
    """
    column = table.columns[place]
    if said is None and column.unit == "C" and _TEMPERATURE.search(column.name):
        raise DataError(
            f"{table.label}: column '{printable(column.name, 40)}' is named like a temperature, so "
            f"that its C is a degree Celsius, in which no {what} is read. Choose another column by "
            f"--{what}, and give this one by --temperature if it is the device's. If it is a "
            f"charge in coulombs, say --{what}-unit C."
        )


def time_column(table: Table, options: ImportOptions) -> int | None:
    """The column of the time: the one that is named, or one that is a clock by its name."""
    return table.find(options.time, "--time") if options.time is not None else table.find_time()
