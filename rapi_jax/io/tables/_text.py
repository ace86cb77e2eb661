"""Tables in text: separator, decimal sign and the first row are found, whatever stands above."""

import dataclasses
import re
from collections import Counter
from collections.abc import Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._last_row import ROWS, check_last_row
from rapi_jax.io._safe import cause, located, open_regular, printable

from ._header import read_header
from ._table import Table
from ._tester import stated_above

_HEAD = 1000  # lines in which the samples must begin
_ALIKE = 20  # rows that must follow on the first
_DELIMITERS: tuple[str | None, ...] = ("\t", ";", ",", None)
_MISSING = {"", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "-", "---", "inf", "-inf"}
_INTEGER, _FRACTION = re.compile(r"[-+]?\d+"), re.compile(r"\d+([eE][-+]?\d+)?")
_INFINITE = "\u221e"  # how PicoScope writes a reading beyond its range
_STAMP = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(:\d\d)?\S*|\d{1,2}:\d\d:\d\d([.,]\d+)?")


def read_text_tables(path: Path) -> list[Table]:
    """The tables in a text file: one, or several below each other under the same line of names.

    Raises `DataError` where it holds no rows of numbers.
    """
    label = printable(path)
    text = _decode(path, label)
    lines = text.rstrip().split("\n")
    if lines == [""]:
        raise DataError(f"{label}: the file is empty. Record or export it again.")
    rows = [(d, *_find_rows(lines, d)) for d in _DELIMITERS]
    delimiter, use, first = max(rows, key=lambda one: len(one[1]))  # of equals, the first
    if not use:
        raise DataError(
            f"{label}: no rows of numbers within the first {min(_HEAD, len(lines))} lines; it "
            f"begins with '{printable(lines[0].strip(), 60)}'. Give a table of numbers: one row a "
            "sample, separated by commas, semicolons, tabs or spaces."
        )
    if delimiter == ",":
        _check_commas(lines, first, label)
    sections = _sections(lines, first, delimiter, use)
    once = {tuple(lines[begin:end]): (begin, end) for begin, end in reversed(sections)}
    if len(once) < len(sections):  # an analyser shows a measurement once more
        sections = [section for section in sections if section in once.values()]
    if len(once) == 1:
        ((begin, end),) = sections
        return [_table_of(label, text, lines[:end], delimiter, use, begin)]
    if len(sections) > 1:
        found, above = [], 0
        for k, (begin, end) in enumerate(sections):
            table = _table_of(f"{label}, table {k + 1}", text, lines[:end], delimiter, use, begin)
            began, rate = stated_above(lines[above:begin])
            found.append(dataclasses.replace(table, began=began, rate_hz=rate))
            above = end
        return found
    return [_table_of(label, text, lines, delimiter, use, first)]


def _check_commas(lines: list[str], first: int, label: str) -> None:
    """Refuse a file in which commas part the columns and mark the decimals, too."""
    names = len(_cells(lines[first - 1], ",")) if first else 0
    rows = [_cells(line, ",") for line in lines[first : first + _ALIKE] if line.strip()]
    halves = all(
        len(row) > names
        and len(row) % 2 == 0
        and all(_INTEGER.fullmatch(cell) for cell in row[::2])
        and all(_FRACTION.fullmatch(cell) for cell in row[1::2])
        for row in rows
    )
    if names and halves:
        raise DataError(
            f"{label}: a comma is both the separator and the decimal sign: each row has "
            f"{len(rows[0])} cells under {names} names. Export it with decimal points, or with "
            "semicolons or tabs between the columns."
        )


def _sections(
    lines: list[str], first: int, delimiter: str | None, use: list[int]
) -> list[tuple[int, int]]:
    """First line of each table, and one past its last, where the line of names comes again."""
    names = lines[first - 1] if first else ""
    if not any(cell and not is_number(cell) for cell in _cells(names, delimiter)):
        return []
    begins = [k + 1 for k, line in enumerate(lines) if line == names]
    found = []
    for begin in begins:
        end = begin  # a blank line ends a table, and so do two without numbers: one is a slip
        while end < len(lines) and lines[end].strip():
            if all(not set(use) <= _numeric(line, delimiter) for line in lines[end : end + 2]):
                break
            end += 1
        if end > begin:
            found.append((begin, end))
    return found if len(begins) > 1 else []


def _table_of(
    label: str,
    text: str,
    lines: list[str],
    delimiter: str | None,
    use: list[int],
    first: int,
) -> Table:
    rows = [line for line in lines[first:] if line.strip()]
    comma = delimiter != "," and any("," in row for row in rows[:_ALIKE])
    decimal = "," if comma else "."
    head = _first_row(lines, first, delimiter, use)
    split = [_cells(line.lstrip("#% "), delimiter) for line in lines[max(head - _HEAD, 0) : head]]
    sample = [_cells(row, delimiter) for row in rows[:_ALIKE]]
    header = read_header(split, sample, use, decimal=decimal)
    names = {None: "spaces", "\t": "tabs", ";": "semicolons", ",": "commas"}
    form = f"text, separated by {names[delimiter]}" + (", decimal commas" if comma else "")
    if head < first:
        form += f", {first - head} row(s) without readings left out before its first reading"
    stamped = [i for i in use if _STAMP.fullmatch(sample[0][i])]

    def load(numbers: Sequence[int]) -> list[np.ndarray]:
        places = [use[header.kept[number]] for number in numbers]
        columns = _load(rows, delimiter, places, stamped, comma, label, lines, first)
        if not text.endswith("\n") and use[-1] in places:
            ends = [[_cells(row, delimiter)[use[-1]]] for row in rows[-ROWS:]]
            with located(label):
                check_last_row(ends, [columns[places.index(use[-1])]])
        return columns

    recorded = _stamp(sample[0][stamped[0]], label)[1] if stamped else None
    return Table(
        label, form, header.columns, load, header.step_s, recorded,
        line_of=lambda sample: _line(rows, sample, lines, first),
    )  # fmt: skip


def _decode(path: Path, label: str) -> str:
    with open_regular(path) as file:
        content = file.read()
    code = "utf-16" if content[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    if b"\0" in content and code != "utf-16":
        raise DataError(
            f"{label}: holds NUL bytes, so it is not text, or was cut short by a crash. Known "
            "forms are text, .mat, .npy, .npz, HDF5, netCDF-4 and TDMS: export it as one of these."
        )
    try:
        text = content.decode(code)
    except UnicodeDecodeError:
        text = content.decode("latin-1")  # a micro sign or a degree sign of an older program
    return text.replace("\r\n", "\n").replace("\r", "\n").replace(_INFINITE, "inf")


def _cells(line: str, delimiter: str | None) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def is_number(cell: str) -> bool:
    """Whether a cell is a number, or stands for one that is missing, but is not empty."""
    try:
        float(cell)
    except ValueError:
        return bool(cell) and cell.lower() in _MISSING
    return cell.isascii() and "_" not in cell


def _numeric(line: str, delimiter: str | None) -> frozenset[int]:
    cells = _cells(line, delimiter)
    if delimiter != ",":
        cells = [cell.replace(",", ".") for cell in cells]
    return frozenset(i for i, cell in enumerate(cells) if is_number(cell) or _STAMP.fullmatch(cell))


def _find_rows(lines: list[str], delimiter: str | None) -> tuple[list[int], int]:
    """The numbers of the columns that hold numbers at the file's end, and where rows begin."""
    tail = Counter(_numeric(line, delimiter) for line in lines[-_ALIKE:] if line.strip())
    use, _ = max(tail.items(), key=lambda pair: (pair[1], len(pair[0])))
    if not use:
        return [], 0
    full = [use <= _numeric(line, delimiter) for line in lines[: _HEAD + _ALIKE]]
    blank = [not line.strip() for line in lines[: _HEAD + _ALIKE]]
    for i in range(min(_HEAD, len(lines))):
        after = range(i, min(i + _ALIKE, len(full)))
        good = sum(full[k] or blank[k] for k in after)
        if full[i] and good >= 0.8 * len(after):
            if any(_is_names(lines[k], delimiter, use) for k in after):
                continue  # a short table of something else: the samples have names of their own
            return sorted(use), i
    return [], 0


def _first_row(lines: list[str], first: int, delimiter: str | None, use: list[int]) -> int:
    """Where the rows begin of which `first` is the first whole one.

    A Keysight scope writes the times before its first reading, too, with nothing beside them.
    """
    while first > 0:
        cells = _cells(lines[first - 1], delimiter)
        numeric = _numeric(lines[first - 1], delimiter)
        inside = [i for i in use if i < len(cells)]
        if not any(i in numeric for i in inside) or any(cells[i] for i in set(inside) - numeric):
            break
        first -= 1
    return first


def _is_names(line: str, delimiter: str | None, use: frozenset[int]) -> bool:
    """Whether a line has a word, and no number, in every column that holds numbers."""
    cells = _cells(line, delimiter)
    return len(use) > 1 and all(
        i < len(cells) and cells[i].lower() not in _MISSING and not _STAMP.fullmatch(cells[i])
        for i in use
    ) and not use & _numeric(line, delimiter)  # fmt: skip


def _load(
    rows: list[str],
    delimiter: str | None,
    places: list[int],
    stamped: list[int],
    comma: bool,
    label: str,
    lines: list[str],
    first: int,
) -> list[np.ndarray]:
    plain = [place for place in places if place not in stamped]
    found: dict[int, np.ndarray] = {}
    if plain:
        text = (row.replace(",", ".") for row in rows) if comma else iter(rows)
        try:
            block = np.loadtxt(text, comments=None, delimiter=delimiter, usecols=plain, ndmin=2)
            found = {place: block[:, k] for k, place in enumerate(plain)}
        except ValueError:
            found = _load_slowly(rows, delimiter, plain, comma, label, lines, first)
    for place in set(places) & set(stamped):
        seconds = [_stamp(_cells(row, delimiter)[place], label)[0] for row in rows]
        found[place] = np.array(seconds) - seconds[0]
    return [np.ascontiguousarray(found[place]) for place in places]


def _load_slowly(
    rows: list[str],
    delimiter: str | None,
    places: list[int],
    comma: bool,
    label: str,
    lines: list[str],
    first: int,
) -> dict[int, np.ndarray]:
    """Cell by cell: words that stand for a missing reading become NaN, others are refused."""
    found = {place: np.empty(len(rows)) for place in places}
    for k, row in enumerate(rows):
        cells = _cells(row, delimiter)
        for place in places:
            cell = cells[place] if place < len(cells) else None
            if cell is None:
                raise DataError(
                    f"{label}: line {_line(rows, k, lines, first)} has no column {place}: it was "
                    "likely cut short. Export the file again, or remove that line."
                )
            cell = cell.replace(",", ".") if comma else cell
            if cell.lower() in _MISSING:
                found[place][k] = np.nan
                continue
            if not is_number(cell):
                raise DataError(
                    f"{label}: line {_line(rows, k, lines, first)}: column {place} must be a "
                    f"number, but is '{printable(cell, 40)}'. Correct that line, or write nan "
                    "where a reading is missing."
                )
            found[place][k] = float(cell)
    return found


def _line(rows: list[str], k: int, lines: list[str], first: int) -> int:
    filled = [i for i in range(first, len(lines)) if lines[i].strip()]
    return filled[k] + 1


def _stamp(cell: str, label: str) -> tuple[float, str | None]:
    """A time stamp in seconds, and as text where it names its offset from UTC."""
    try:
        if cell[2:3] == ":" or cell[1:2] == ":":
            hours, minutes, seconds = cell.replace(",", ".").split(":")
            return 3600.0 * float(hours) + 60.0 * float(minutes) + float(seconds), None
        time = datetime.fromisoformat(cell.replace(",", "."))
        naive = time.replace(tzinfo=None) - (time.utcoffset() or time - time)
        zero = datetime(2000, 1, 1)  # noqa: DTZ001 (differences alone matter)
        return (naive - zero).total_seconds(), cell if time.tzinfo else None
    except ValueError as error:
        raise DataError(
            f"{label}: '{printable(cell, 40)}' is no time stamp ({cause(error)}). Write "
            "2026-11-24T10:00:00.123, or a time in s."
        ) from error
