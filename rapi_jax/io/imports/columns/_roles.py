"""Columns that cannot be what they are taken for: a time that goes back, a drive that is a time."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax.io._safe import printable
from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import DRIVES, RESPONSES, TIMES, known_unit
from rapi_jax.sampling._phase import turning_samples

from ._clock_column import find_clock_columns, is_clock
from ._command import column_key, import_command
from ._open_question import OpenQuestion
from ._stated_units import time_column

Samples = Float[np.ndarray, " samples"]
_UNITS = {"time": TIMES, "drive": DRIVES, "response": RESPONSES}


@dataclasses.dataclass(frozen=True, eq=False)
class Roles:
    """Which column of a table is taken for the time, the drive and the response.

    `places`: by role, those that are columns of `table`. `path`: of the file, as it was given.
    """

    table: Table
    path: str
    options: ImportOptions
    places: dict[str, int]

    @classmethod
    def of(cls, table: Table, path: str, options: ImportOptions, places: dict[str, int]) -> "Roles":
        """The roles in one table; a drive in a file of its own has none there."""
        found = {what: at for what, at in places.items() if what in _UNITS}
        if options.drive_file is not None:
            found.pop("drive", None)
        at = None if options.sample_rate is not None else time_column(table, options)
        if at in found.values() and options.time is None and _has_step(table, places):
            at = None  # a position that is called x, say
        return cls(table, path, options, found | ({} if at is None else {"time": at}))

    def check_units(self) -> None:
        """Ask where the file's unit of a column cannot be that of its role, but of another's."""
        for what in self.places:
            unit = self._unit(what)
            if unit is None or getattr(self.options, f"{what}_unit") is not None:
                continue
            if (what == "time") != (unit in TIMES):
                kind = "no unit of a time" if what == "time" else "a unit of time"
                self._ask(what, f"its unit is {unit}, {kind}")
        for what in self.places.keys() & {"drive", "response"}:
            if self.options.time is None and self.places[what] == self.places.get("time"):
                self._ask(what, "by its name it is the time")
        if self._exchanged_by_units():
            self._ask("drive", f"its unit is {self._unit('drive')}, no unit of a drive")

    def check_time(self, time: Samples) -> None:
        """Ask where a time goes back again and again, and another column is a clock."""
        if "time" not in self.places:
            return
        back = int((np.diff(time) < 0).sum())
        if back > THRESHOLDS.backward_steps * max(time.size - 1, 1):
            if find_clock_columns(self.table, self.places["time"]):
                self._ask("time", f"it goes back {back} times")

    def check_moving(self, drive: Samples, response: Samples) -> list[str]:
        """Ask where a response is a clock under a drive that turns; a remark on the reverse.

        A single ramp of a generator is as even as a clock, so of a drive nothing is certain.
        """
        even = "rises evenly from its first sample to its last, as a time does"
        if "response" in self.places and is_clock(response) and _turns(drive):
            self._ask("response", f"it {even}")
        if not {"drive", "response"} <= self.places.keys():
            return []
        if not is_clock(drive) or not _turns(response):
            return []
        name = printable(column_key(self.table, self.places["drive"]), 40)
        return [
            f"the drive (column '{name}') {even}, while the response turns {_turns(response)} "
            "times. If it is a time, name another column by --drive"
        ]

    def _ask(self, what: str, why: str) -> None:
        table = self.table
        name = printable(table.columns[self.places[what]].name, 40)
        likely = self._likely(what)
        if likely:
            named = (f"'{key}' is the {role}" for role, key in likely.items())
            line = import_command([self.path], dataclasses.replace(self.options, **likely))
            cure = f"Most likely {' and '.join(named)}: `{line}`."
        else:
            cure = f"Name another by --{what}."
        raise OpenQuestion(
            f"{table.label}: which column is the {what}? '{name}' is taken for it, but {why}. "
            f"{cure} Columns, by number or name: {table.describe(values=True)}."
        )

    def _likely(self, what: str) -> dict[str, str]:
        """By role, the columns that are likely right; empty where the table does not tell."""
        table, here = self.table, self.places[what]
        if what == "drive" and self._exchanged_by_units():
            return self._exchange("drive", "response")
        if what != "time":
            if self.options.time is not None and not self._is_time(self.places["time"]):
                return self._exchange("time", what)
            used = {*self.places.values()}
            free = [i for i, one in enumerate(table.columns) if i not in used and not one.is_time]
            return {what: column_key(table, free[0])} if len(free) == 1 else {}
        clocks = [i for i, one in enumerate(table.columns) if one.is_time and i != here]
        clocks = clocks or find_clock_columns(table, here)
        if not clocks:
            return {}
        for role in ("drive", "response"):
            if self.places.get(role) == clocks[0]:
                return self._exchange("time", role)
        return {"time": column_key(table, clocks[0])}

    def _exchange(self, one: str, other: str) -> dict[str, str]:
        key = {role: column_key(self.table, self.places[role]) for role in (one, other)}
        return {one: key[other], other: key[one]}

    def _unit(self, what: str) -> str | None:
        at = self.places.get(what)
        return None if at is None else known_unit(self.table.columns[at].unit or "")

    def _is_time(self, place: int) -> bool:
        column = self.table.columns[place]
        return column.is_time or known_unit(column.unit or "") in TIMES

    def _exchanged_by_units(self) -> bool:
        """Whether only the reverse of drive and response has units that such columns have."""
        drive, response = self._unit("drive"), self._unit("response")
        said = self.options.drive_unit, self.options.response_unit
        apart = drive in RESPONSES and drive not in DRIVES and response in DRIVES
        return said == (None, None) and apart


def _has_step(table: Table, places: dict[str, int]) -> bool:
    """Whether a header says when the columns were sampled."""
    return table.step_s is not None or any(
        table.columns[at].step_s is not None for at in places.values()
    )


def _turns(value: Samples) -> int:
    """How often a signal turns, where it does so more than once; else 0."""
    finite = value[np.isfinite(value)]
    inner = turning_samples(finite, THRESHOLDS.turn).size - 2 if finite.size > 2 else 0
    return inner if inner > 1 else 0
