"""The line of `rapi import` that stands for some options."""

import dataclasses
import os
import shlex
from collections.abc import Sequence

from rapi_jax._errors import DataError
from rapi_jax.io._safe import StrPath
from rapi_jax.io.imports._options import ImportOptions, MadeDrive
from rapi_jax.io.tables._table import Table

_NAMES = {
    "response_lag_s": "response-lag", "temperature_c": "temperature", "rates": "rate",
    "tables": "table",
}  # fmt: skip


def import_command(
    files: Sequence[StrPath], options: ImportOptions, output: str | None = None
) -> str:
    """`rapi import` with what `options` say beside their defaults, as a shell takes it.

    >>> from rapi_jax.io import ImportOptions
    >>> from rapi_jax.io.imports.columns._command import import_command
    >>> options = ImportOptions(drive="CH 1", response_scale=4.5, response_unit="GHz", cut=False)
    >>> import_command(["scope.csv"], options, "my-recording")
    "rapi import scope.csv --drive 'CH 1' --response-unit GHz --response-scale 4.5 --no-cut -o \
my-recording"
    """
    words = ["rapi", "import", *(os.fspath(file) for file in files)]
    for field in dataclasses.fields(options):
        value = getattr(options, field.name)
        if value == field.default:
            continue
        name = _NAMES.get(field.name, field.name.replace("_", "-"))
        if isinstance(value, bool):
            words.append(f"--{name}" if value else f"--no-{name}")
        elif isinstance(value, MadeDrive):
            for part in dataclasses.fields(value):
                if (said := getattr(value, part.name)) != part.default:
                    words += _option(f"drive-{part.name}", said)
        else:
            for one in value if isinstance(value, tuple) else (value,):
                words += _option(name, one)
    return shlex.join([*words, *([] if output is None else ["-o", output])])


def _option(name: str, value: object) -> list[str]:
    text = str(value)
    if isinstance(value, float) and float(f"{value:g}") == value:
        text = f"{value:g}"
    if text.startswith("-") and not isinstance(value, int | float):
        return [f"--{name}={text}"]
    return [f"--{name}", text]


def column_key(table: Table, place: int) -> str:
    """What an option may call a column: its name, where that names no other, or its number."""
    column = table.columns[place]
    for name in (column.bare, column.name):
        if not name or len(name) > 40 or not name.isprintable():
            continue
        try:
            if table.find(name, "") == place:
                return name
        except DataError:  # several have that name
            continue
    return str(place)
