"""Traces that an oscilloscope saved as CSV, by a small map of their columns."""

from collections.abc import Iterable, Mapping
from pathlib import Path

from rapi_jax._errors import DataError
from rapi_jax.io import _units
from rapi_jax.io._safe import StrPath, located, printable, read_text
from rapi_jax.recording._drive import Waveform
from rapi_jax.recording._recording import Origin, Recording
from rapi_jax.recording._run import Run

from . import _csv
from ._build import NanPolicy, build_run, check_nan_policy

_HEAD = 1000  # lines in which the samples must begin


def read_oscilloscope(
    path: StrPath,
    columns: Mapping[str, str | int],
    *,
    response_unit: str,
    drive_unit: str,
    excitation_hz: float | None = None,
    waveform: Waveform = "other",
    start_s: float = 0.0,
    scale: Mapping[str, float] | None = None,
    name: str | None = None,
    nan: NanPolicy = "raise",
) -> Run:
    """Read one run from an oscilloscope's CSV file; time is shifted to start at 0.

    Header lines are skipped, further columns and trailing separators ignored; separators may be
    commas, semicolons or tabs, the last two also with decimal commas.

    - `columns`: for each of `time_s`, `drive` and `response`, the name in any header line, or the
      number of the column from 0.
    - `response_unit`, `drive_unit`: of the numbers after `scale`; converted as in `read_recording`.
    - `scale`: factors by column, such as `{"time_s": 1e-3}` for a time in ms.
    - `name`: of the run; default, the stem of the file.

    Raises `DataError` with the file and the line.

    >>> import numpy as np
    >>> from rapi_jax.io import read_oscilloscope
    >>> with open("scope.csv", "w") as file:
    ...     print("TIME (s),CH1 (V),CH2 (V)", file=file)
    ...     for k in range(400):
    ...         volt = 3.0 - 2.0 * np.cos(2 * np.pi * k / 100)
    ...         print(f"{k / 2000},{volt},{4.0 * volt}", file=file)
    >>> run = read_oscilloscope(
    ...     "scope.csv", {"time_s": 0, "drive": 1, "response": 2},
    ...     response_unit="V", drive_unit="V", excitation_hz=20.0, waveform="sine",
    ... )
    >>> run.drive.periods, round(run.span, 6)  # V
    (4, 16.0)
    """
    check_nan_policy(nan)
    factors = dict(scale or {})
    if set(columns) != set(_csv.HEADER):
        raise ValueError(
            f"Argument `columns` must name {', '.join(_csv.HEADER)}, but has {list(columns)}."
        )
    if not set(factors) <= set(_csv.HEADER):
        raise ValueError(
            f"Argument `scale` may name {', '.join(_csv.HEADER)}, but has {list(factors)}."
        )
    path = Path(path)
    label = printable(path)
    lines = read_text(path).rstrip().split("\n")
    with located(label):
        delimiter, use, first = _find_samples(lines, [columns[key] for key in _csv.HEADER])
        rows = lines[first:]
        if delimiter != ",":
            rows = [row.replace(",", ".") for row in rows]
        values = _csv.parse_rows(rows, delimiter, use, first_line=first + 1)
    time, drive, response = (
        column * factors.get(key, 1.0) for key, column in zip(_csv.HEADER, values, strict=True)
    )
    return build_run(
        (time - time[0], drive, response),
        label=label,
        name=path.stem if name is None else name,
        drive_unit=drive_unit,
        response_unit=response_unit,
        excitation_hz=excitation_hz,
        waveform=waveform,
        start_s=start_s,
        nan=nan,
    )


def join_runs(
    runs: Iterable[Run],
    *,
    response_unit: str,
    drive_unit: str,
    response_origin: Origin = "session",
    response_lag_s: float = 0.0,
    provenance: Mapping[str, str] | None = None,
) -> Recording:
    """One `Recording` from runs of one session, given the units that they were read with.

    Raises `DataError` where the numbers are implausible in those units.

    >>> from rapi_jax.io import join_runs
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> recording = Recording.of(drives, [predict(paper_device(), drive) for drive in drives])
    >>> joined = join_runs(recording.runs, response_unit="GHz", drive_unit="V")
    >>> len(joined.runs), joined.response_unit
    (2, 'GHz')
    """
    recording = Recording(
        tuple(runs),
        response_unit=_units.response_unit(response_unit)[0],
        drive_unit=_units.drive_unit(drive_unit)[0],
        response_origin=response_origin,
        response_lag_s=response_lag_s,
        provenance=dict(provenance or {}),
    )
    _units.check_plausible(recording)
    return recording


def _find_samples(lines: list[str], wanted: list[str | int]) -> tuple[str, list[int], int]:
    """The separator, the numbers of the wanted columns, and the line where samples begin."""
    faults = []
    for delimiter in ("\t", ";", ","):
        try:
            return delimiter, *_find_columns(lines[:_HEAD], delimiter, wanted)
        except DataError as error:
            faults.append((max(line.count(delimiter) for line in lines[:_HEAD]), error))
    raise max(faults, key=lambda fault: fault[0])[1]


def _find_columns(
    lines: list[str], delimiter: str, wanted: list[str | int]
) -> tuple[list[int], int]:
    header: dict[str, set[int]] = {}
    for at, line in enumerate(lines):
        cells = [cell.strip().strip('"').strip() for cell in line.split(delimiter)]
        use = [_resolve(header, key) for key in wanted]
        known = [i for i in use if i is not None and i < len(cells)]
        decimal = [cells[i] if delimiter == "," else cells[i].replace(",", ".") for i in known]
        if len(known) == len(wanted) and all(map(_csv.is_number, decimal)):
            return known, at
        for i, cell in enumerate(cells):
            if cell and not _csv.is_number(cell):
                header.setdefault(cell, set()).add(i)
    missing = [key for key in wanted if _resolve(header, key) is None]
    if missing:
        names = printable(", ".join(header), 160) or "none"
        raise DataError(
            f"no column '{printable(missing[0], 40)}'; names found: {names}. Give one of them, or "
            "the column's number from 0."
        )
    raise DataError(
        f"no samples in columns {', '.join(map(repr, wanted))} within the first {len(lines)} "
        "lines. Check the columns, and that the file holds a trace."
    )


def _resolve(header: Mapping[str, set[int]], key: str | int) -> int | None:
    if isinstance(key, int):
        if key < 0:
            raise ValueError(f"Argument `columns` must count from 0, but has {key}.")
        return key
    places = header.get(key, set())
    if len(places) > 1:
        raise DataError(
            f"several columns are called '{printable(key, 40)}': give the number of one of "
            f"{sorted(places)}."
        )
    return next(iter(places), None)
