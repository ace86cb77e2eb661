"""Columns of numbers by name, wherever they come from."""

import dataclasses
import datetime
import difflib
import re
from collections.abc import Callable, Mapping, Sequence

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._safe import printable

from ._units import split_unit

_TIMES = {
    "time", "t", "time_s", "times", "second", "seconds", "zeit", "x", "x-axis", "in s", "x_value",
}  # fmt: skip
_SHOWN = 24  # columns in a message: the twelve quantities of a ferroelectric tester, and as many


def is_time_name(name: str) -> bool:
    """Whether a name is that of a clock."""
    return name.lower() in _TIMES


@dataclasses.dataclass(frozen=True)
class Column:
    """What a file says of one column.

    `name`: as the file writes it; `bare`: without a unit in it. `unit`: as the file writes it,
    `None` where it says none. `step_s`, `start_s`: a clock of its own, s, where it has one.
    """

    name: str
    bare: str = ""
    unit: str | None = None
    step_s: float | None = None
    start_s: float = 0.0

    @property
    def names(self) -> tuple[str, ...]:
        """What it may be called."""
        plain = re.split(r"\s*[\[(]", self.name)[0]  # "P1 [uC/cm2]" is P1, too
        return tuple(dict.fromkeys(name for name in (self.name, self.bare, plain) if name))

    @property
    def is_time(self) -> bool:
        """Whether its name is that of a clock."""
        return any(is_time_name(name) for name in self.names)


@dataclasses.dataclass(frozen=True, eq=False)
class Table:
    """The columns of one file, loaded when asked for.

    - `label`: the file, printable. `form`: what kind of file it is, in words.
    - `load`: the values of columns by number, each one-dimensional float64.
    - `step_s`: sampling interval that a header states, s; `None` where none does.
    - `recorded_at`: time of the first sample, where the file states it with its offset from UTC.
    - `began`: the same without an offset, of one table among several. `rate_hz`: its scan rate, Hz,
      where the file states it.
    - `line_of`: the line of a sample in a file of text, counted from 1; `None` for other files.
    """

    label: str
    form: str
    columns: tuple[Column, ...]
    load: Callable[[Sequence[int]], list[np.ndarray]]
    step_s: float | None = None
    recorded_at: str | None = None
    began: datetime.datetime | None = None
    rate_hz: float | None = None
    line_of: Callable[[int], int] | None = None

    def place(self, sample: int) -> str:
        """Where a sample stands, for a message: by its number, and by its line in text."""
        line = "" if self.line_of is None else f" (line {self.line_of(sample)})"
        return f"sample {sample}{line}"

    def describe(self, *, values: bool = False) -> str:
        """The columns by number, name and unit, on one line; `values`: of nameless ones, the range.

        A file without names is told apart by its numbers alone.
        """
        shown = []
        ranges = self._ranges() if values else {}
        for i, column in enumerate(self.columns[:_SHOWN]):
            name = printable(column.name, 40)
            unit = f" ({printable(column.unit, 12)})" if column.unit else ""
            unit = "" if split_unit(column.name)[1] else unit
            shown.append((f"{i} '{name}'" if name != str(i) else f"{i}") + unit + ranges.get(i, ""))
        more = len(self.columns) - _SHOWN
        return ", ".join(shown) + (f" and {more} more" if more > 0 else "")

    def _ranges(self) -> dict[int, str]:
        """Lowest and highest value of each column without a name; none where they are damaged."""
        nameless = [i for i, c in enumerate(self.columns[:_SHOWN]) if c.name == str(i)]
        try:
            columns = self.load(nameless) if nameless else []
        except DataError:
            return {}
        finite = [column[np.isfinite(column)] for column in columns]
        return {
            i: f" ({part.min():.4g} to {part.max():.4g})"
            for i, part in zip(nameless, finite, strict=True)
            if part.size
        }

    def find(self, key: str, option: str) -> int:
        """The number of the column `key`, a name or a number from 0.

        Raises `DataError` naming `option`, the nearest name and all columns where there is none.
        """
        return self.find_each({option: key})[option]

    def find_each(self, keys: Mapping[str, str]) -> dict[str, int]:
        """The number of the column of each option. Raises one `DataError` for all not found."""
        found = {option: self._find(key, option) for option, key in keys.items()}
        missing = [option for option, place in found.items() if place is None]
        if missing:
            which = [f"'{printable(keys[option], 40)}' for {option}" for option in missing]
            near = dict.fromkeys(name for one in missing for name in self._nearest(keys[one]))
            meant = [f"'{printable(name, 40)}'" for name in near]
            raise DataError(
                f"{self.label}: no column {', and none '.join(which)}."
                + (f" Did you mean {' and '.join(meant)}?" if meant else "")
                + f" Columns, by number or name: {self.describe() or 'none'}."
            )
        return {option: place for option, place in found.items() if place is not None}

    def _find(self, key: str, option: str) -> int | None:
        for same in (str, str.lower):
            places = [
                i for i, column in enumerate(self.columns) if same(key) in map(same, column.names)
            ]
            if len(places) == 1:
                return places[0]
            if places:
                raise DataError(
                    f"{self.label}: several columns are called '{printable(key, 40)}': give "
                    f"{option} the number of one of {places}."
                )
        known = key.isascii() and key.isdigit() and int(key) < len(self.columns)
        return int(key) if known else None

    def _nearest(self, key: str) -> list[str]:
        """The name most like `key`, if one is."""
        names = [name for column in self.columns for name in column.names]
        return difflib.get_close_matches(key[:60], names[:1000], n=1, cutoff=0.5)

    def find_time(self) -> int | None:
        """The column that is a clock by its name or its unit; `None` where none is alone."""
        found = [i for i, column in enumerate(self.columns) if column.is_time]
        return found[0] if found else None


def columns_of(name: str, array: np.ndarray) -> list[tuple[str, np.ndarray]]:
    """An array as columns: itself, each of its fields, or its columns along the shorter axis.

    Arrays that are not of real numbers, or have more than two dimensions, give none.
    """
    if array.dtype.names:
        fields = ((f"{name}.{field}".lstrip("."), array[field]) for field in array.dtype.names)
        return [pair for field, part in fields for pair in columns_of(field, part)]
    if array.dtype.kind not in "fiub":
        return []
    array = np.squeeze(array)
    if array.ndim == 1 and array.size > 1:
        return [(name, array)]
    if array.ndim != 2:
        return []
    table = array if array.shape[0] >= array.shape[1] else array.T
    prefix = f"{name}:" if name else ""
    return [(f"{prefix}{i}", table[:, i]) for i in range(table.shape[1])]


def table_of(label: str, form: str, pairs: Sequence[tuple[str, np.ndarray]]) -> Table:
    """A table of arrays that are in memory."""

    def load(use: Sequence[int]) -> list[np.ndarray]:
        return [np.ascontiguousarray(pairs[i][1], dtype=np.float64) for i in use]

    columns = []
    for name, _ in pairs:
        bare, unit = split_unit(name)
        columns.append(Column(name, bare, unit))
    return Table(label, form, tuple(columns), load)
