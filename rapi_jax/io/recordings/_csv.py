"""Columns of numbers in text files: fast where they are right, with the line where they are not."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io._last_row import ROWS, check_last_row
from rapi_jax.io._safe import located, printable, read_text

HEADER = ("time_s", "drive", "response")
Columns = tuple[np.ndarray, np.ndarray, np.ndarray]


def read_columns(path: Path, label: str, samples: int | None = None) -> Columns:
    """Time, drive and response of a run's CSV file; further columns are ignored.

    `samples`: how many the manifest says there are, where `write_recording` wrote it.

    Raises `DataError`, with `label` and the line, where the header differs or a row is ragged,
    empty or not numeric.
    """
    text = read_text(path)
    with located(label):
        lines = text.rstrip("\n").split("\n")
        header = tuple(cell.strip() for cell in lines[0].split(","))
        if header[:3] != HEADER:
            found = f"'{printable(lines[0], 60)}'" if text.strip() else "nothing: the file is empty"
            raise DataError(
                f"line 1 must begin with {','.join(HEADER)}, but is {found}.{_foreign(lines[0])}"
            )
        if len(set(header)) < len(header):
            raise DataError("line 1 names a column twice. Keep the one that is meant.")
        rows = lines[1:]
        if not rows:
            raise DataError("has a header, but no samples. Record or export it again.")
        if {row.count(",") for row in rows} != {len(header) - 1}:
            at = next(i for i, row in enumerate(rows) if row.count(",") != len(header) - 1)
            cells = rows[at].count(",") + 1 if rows[at].strip() else 0
            raise DataError(
                f"line {at + 2} has {cells} value(s), but the header names {len(header)}. The file "
                "was likely cut short or edited: export it again."
            )
        if samples is not None and (len(rows) != samples or not text.endswith("\n")):
            cut = "" if text.endswith("\n") else ", the last of them cut"
            raise DataError(
                f"holds {len(rows)} sample(s){cut}, but the manifest says {samples}: the file was "
                "cut short. Copy it again; or, where rows were taken out on purpose, remove "
                "`samples` from the manifest."
            )
        columns = parse_rows(rows, ",", (0, 1, 2), first_line=2)
        if not text.endswith("\n"):
            check_last_row([row.split(",")[:3] for row in rows[-ROWS:]], columns)
        return columns


def _foreign(line: str) -> str:
    """The likely cause and cure, where a file begins unlike that of a recording."""
    if not line.strip():
        return " Record or export it again."
    signs = {";": "semicolons", "\t": "tabs"}
    cause = "Correct the names, or, where another program wrote the file:"
    for other in (name for sign, name in signs.items() if sign in line):
        cause = f"It is separated by {other}, as other programs write it:"
    return f" {cause} `rapi import` makes a recording of it."


def parse_rows(rows: list[str], delimiter: str, use: Sequence[int], *, first_line: int) -> Columns:
    """The three columns `use` of rows of text. Raises `DataError` naming the line."""
    try:
        table = np.loadtxt(
            io.StringIO("\n".join(rows)),
            dtype=np.float64,
            comments=None,
            delimiter=delimiter,
            usecols=tuple(use),
            ndmin=2,
        )
    except ValueError as error:
        raise DataError(_locate(rows, delimiter, use, first_line)) from error
    time, drive, response = (np.ascontiguousarray(table[:, i]) for i in range(3))
    return time, drive, response


def is_number(cell: str) -> bool:
    """Whether a cell is a number in plain notation."""
    try:
        float(cell)
    except ValueError:
        return False
    return cell.isascii() and "_" not in cell


def _locate(rows: list[str], delimiter: str, use: Sequence[int], first_line: int) -> str:
    for i, row in enumerate(rows):
        cells = row.split(delimiter)
        for name, at in zip(HEADER, use, strict=True):
            if row and at >= len(cells):
                return f"line {i + first_line} has no column {at + 1}: it was likely cut short."
            if row and not is_number(cells[at]):
                what = f"'{printable(cells[at], 40)}'" if cells[at].strip() else "nothing"
                return (
                    f"line {i + first_line}: `{name}` must be a number, but is {what}. Correct the "
                    "line, or write nan where a reading is missing."
                )
    return "a row is not numeric. Export the file again."


def write_columns(columns: Columns) -> str:
    """CSV text from which `read_columns` reads the same bits."""
    cells = (column.tolist() for column in columns)
    rows = map("%r,%r,%r\n".__mod__, zip(*cells, strict=True))
    return ",".join(HEADER) + "\n" + "".join(rows)
