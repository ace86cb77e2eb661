"""What stands above a table: names, units and the sampling interval, as makers write them.

Layouts, from public manuals and examples: Tektronix (`TIME,CH1` below a preamble; or the preamble
beside the first rows), Keysight (`x-axis,1,2` above `second,Volt,Volt`), Rigol (`X,CH1,Start,
Increment` above `Sequence,Volt,t0,step`; or `t0 = , tInc = `), Keysight's analysers
(`DataName, V1, I1` above rows that begin with `DataValue`), Siglent (`Source,CH1` above
`Second,Value`), Rohde & Schwarz (`in s,C1 in V`), PicoScope (`Time,Channel A` above `(ms),(V)`).
"""

import dataclasses
import re
from collections.abc import Sequence

from ._table import Column
from ._units import known_unit, split_unit, time_factor

_COUNTS = {"sequence", "index", "sample", "#", "no.", "n"}  # units of a column that only counts
_EMPTY = {"value", "values", ""}  # units that say nothing
_STEP = re.compile(
    r"(?:sample\s*interval|tinc|xinc(?:rement)?|x\s*increment|signal\s*resolution|resolution)"
    r"[^0-9+\-\n]{0,24}?([-+]?[0-9.]+(?:e[-+]?[0-9]+)?)\s*([munp\u00b5]?s)?\b",
    re.IGNORECASE,
)


@dataclasses.dataclass(frozen=True)
class Header:
    """The columns of a table; `kept`: their places among those that hold numbers."""

    columns: tuple[Column, ...]
    kept: tuple[int, ...]
    step_s: float | None


def read_header(
    lines: Sequence[Sequence[str]],
    rows: Sequence[Sequence[str]],
    use: Sequence[int],
    *,
    decimal: str,
) -> Header:
    """Names and units of the columns `use`, from the cells above them and of the first rows."""
    about = {row[0].lower(): row[1:] for row in (*lines, *rows) if row and row[0]}
    labels = {row[0] for row in rows if row[0] and not row[0][:1].isdigit()}
    beside = use[0] > 0 and bool(labels) and (len(labels) > 1 or len(rows) == 1)
    names, units, counts = _from_preamble(about, use) if beside else _from_rows(lines, use)
    columns = []
    for place in use:
        name = names.get(place, "")
        bare, unit = split_unit(name)
        columns.append(Column(name, bare, units.get(place) or unit))
    _name_the_clock(columns, rows, use)
    _add_stated_units(columns, about)
    text = "\n".join(" ".join(row) for row in (*lines, *(rows if beside else ())))
    step = _step(text.replace(",", ".") if decimal == "," else text) or _rigol_step(lines)
    drop = [k for k, place in enumerate(use) if place in counts] if step else []
    kept = tuple(k for k in range(len(use)) if k not in drop)
    return Header(tuple(_named(columns[k], n) for n, k in enumerate(kept)), kept, step)


def _named(column: Column, number: int) -> Column:
    """A column without a name is called by the number that an option gives, not by its place.

    The two differ where an empty column, or one that counts the samples, stands before it.
    """
    if column.name:
        return column
    return dataclasses.replace(column, name=str(number), bare=column.bare or str(number))


def _from_rows(
    lines: Sequence[Sequence[str]], use: Sequence[int]
) -> tuple[dict[int, str], dict[int, str], set[int]]:
    """From the row of names that is nearest above the samples, and a row of units below it."""
    units: dict[int, str] = {}
    counts: set[int] = set()
    for row in reversed(lines):
        cells = {i: row[i] for i in use if i < len(row) and row[i]}
        if not cells:
            continue
        words = {i: cell.lower().strip("()[]") for i, cell in cells.items()}
        if (
            not units
            and not counts
            and all(known_unit(cells[i]) or word in _COUNTS | _EMPTY for i, word in words.items())
        ):
            units = {i: unit for i, cell in cells.items() if (unit := known_unit(cell))}
            counts = {i for i, word in words.items() if word in _COUNTS}
            continue
        if len(cells) < min(2, len(use)) and len(use) > 1:
            break  # a line of text, not of names
        return cells, units, counts
    return {}, units, counts


def _from_preamble(
    about: dict[str, Sequence[str]], use: Sequence[int]
) -> tuple[dict[int, str], dict[int, str], set[int]]:
    """From preambles that stand beside the first rows (Tektronix TDS): one, or one a channel."""
    source = about.get("source", ())
    begins = [0, *(k + 1 for k, cell in enumerate(source) if cell.lower() == "source")]
    names: dict[int, str] = {}
    units: dict[int, str] = {}
    for begin, end in zip(begins, [*begins[1:], max(use) + 1], strict=True):
        own = [place for place in use if begin <= place < end]
        channel = source[begin] if begin < len(source) else ""
        names |= dict(zip(own, (f"TIME {channel}" if begin else "TIME", channel), strict=False))
        for place, key in zip(own, ("horizontal units", "vertical units"), strict=False):
            cells = about.get(key, ())
            unit = known_unit(cells[begin]) if begin < len(cells) else None
            units |= {place: unit} if unit else {}
    return {place: name for place, name in names.items() if name}, units, set()


def _name_the_clock(
    columns: list[Column], rows: Sequence[Sequence[str]], use: Sequence[int]
) -> None:
    """A first column in a unit of time, or of time stamps, is a clock, whatever it is called."""
    first = columns[0]
    stamped = bool(rows) and ":" in rows[0][use[0]]
    try:
        clock = first.unit is not None and time_factor(first.unit) > 0
    except ValueError:
        clock = False
    if (clock or stamped) and not first.is_time:
        columns[0] = dataclasses.replace(first, bare="time", unit="s" if stamped else first.unit)
    elif stamped:
        columns[0] = dataclasses.replace(first, unit="s")


def _add_stated_units(columns: list[Column], about: dict[str, Sequence[str]]) -> None:
    """From lines such as `Horizontal Units,s` and `Vertical Units,V,V` (or `CH1:V,CH2:V`)."""
    clock = next((known_unit(cell) for cell in about.get("horizontal units", ()) if cell), None)
    for k, column in enumerate(columns):
        if column.is_time and column.unit is None and clock:
            columns[k] = dataclasses.replace(column, unit=clock)
    said = [cell for cell in about.get("vertical units", ()) if cell]
    traces = [k for k, column in enumerate(columns) if not column.is_time]
    for k, cell in zip(traces, said, strict=False):
        unit = known_unit(cell.rpartition(":")[2])
        if unit and columns[k].unit is None:
            columns[k] = dataclasses.replace(columns[k], unit=unit)


def _step(text: str) -> float | None:
    found = _STEP.search(text)
    if not found:
        return None
    try:
        step = float(found[1]) * (time_factor(found[2]) if found[2] else 1.0)
    except ValueError:
        return None
    return step if step > 0 else None


def _rigol_step(lines: Sequence[Sequence[str]]) -> float | None:
    """The cell below `Increment`."""
    for above, below in zip(lines[:-1], lines[1:], strict=True):
        lower = [cell.lower() for cell in above]
        if "increment" in lower and lower.index("increment") < len(below):
            try:
                step = float(below[lower.index("increment")])
            except ValueError:
                return None
            return step if step > 0 else None
    return None
