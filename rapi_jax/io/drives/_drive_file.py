"""Drives in files: one period as CSV, and as the codes of an arbitrary function generator."""

import io
import re
from pathlib import Path

import numpy as np

from rapi_jax._arguments import takes
from rapi_jax._errors import DataError
from rapi_jax.io._atomic import write_atomic
from rapi_jax.io._last_row import ROWS, check_last_row
from rapi_jax.io._safe import StrPath, located, printable, read_text
from rapi_jax.recording._drive import Drive, Waveform

from ._afg_waveform import FULL, POINTS, AfgWaveform

HEADER = "time_s,drive"
_AFG = "# rapi.afg/1"
_KEYS = ("frequency_hz", "low_v", "high_v")


@takes(drive=Drive)
def write_drive(drive: Drive, path: StrPath) -> None:
    """Write the samples of `drive` as CSV with the header `time_s,drive`, whole or not at all.

    >>> from pathlib import Path
    >>> from rapi_jax import triangle
    >>> from rapi_jax.io import write_drive
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=100)
    >>> write_drive(drive, "drive.csv")
    >>> Path("drive.csv").read_text().splitlines()[:2]
    ['time_s,drive', '0.0,1.0']
    """
    rows = map("%r,%r\n".__mod__, zip(drive.time.tolist(), drive.value.tolist(), strict=True))
    write_atomic(path, HEADER + "\n" + "".join(rows))


def read_drive(path: StrPath, *, waveform: Waveform = "triangle") -> Drive:
    """Read one period of a drive from CSV: even times from 0, the next period after the last.

    The scan rate follows from the length. Raises `DataError`, in one line, where the file is not
    such a drive.

    >>> from rapi_jax import triangle
    >>> from rapi_jax.io import read_drive, write_drive
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=100)
    >>> write_drive(drive, "drive.csv")
    >>> round(read_drive("drive.csv").excitation_hz, 6)  # Hz
    10.0
    """
    with located(printable(path)):
        text = read_text(Path(path))
        lines = text.rstrip("\n").split("\n")
        if lines[0].replace(" ", "") != HEADER:
            raise DataError(
                f"line 1 must be {HEADER}, but is '{printable(lines[0], 60)}'. Give a drive as "
                "`rapi compensate` writes it, or a recording: `rapi import` makes one of a table "
                "of another program."
            )
        table = _numbers(lines[1:], 2, first_line=2)
        time, value = table[:, 0], table[:, 1]
        if not text.endswith("\n"):
            check_last_row([row.split(",") for row in lines[1:][-ROWS:]], [time, value])
        if time.size < 8:
            raise DataError(f"one period of a drive needs 8 samples or more, not {time.size}.")
        rate = (time.size - 1) / (time.size * (time[-1] - time[0])) if time[-1] > time[0] else 0.0
        return Drive(time, value, rate or None, waveform)


@takes(wave=AfgWaveform)
def write_afg(wave: AfgWaveform, path: StrPath) -> None:
    """Write codes and levels for a generator: a header of `# key = value`, then a code a line.

    >>> from pathlib import Path
    >>> from rapi_jax import AfgWaveform, triangle
    >>> from rapi_jax.io import write_afg
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=100)
    >>> write_afg(AfgWaveform.of(drive), "drive.afg")
    >>> Path("drive.afg").read_text().splitlines()[1]
    '# frequency_hz = 10.0'
    """
    head = [_AFG, *(f"# {key} = {getattr(wave, key)!r}" for key in _KEYS)]
    head += [f"# points = {wave.codes.size}", "code"]
    write_atomic(path, "\n".join([*head, *map(str, wave.codes.tolist())]) + "\n")


def read_afg(path: StrPath) -> AfgWaveform:
    """Read what `write_afg` wrote. Raises `DataError`, in one line, where it is damaged.

    >>> from rapi_jax import AfgWaveform, triangle
    >>> from rapi_jax.io import read_afg, write_afg
    >>> (drive,) = triangle(10.0, amplitude=4.0, bias=3.0, samples=100)
    >>> write_afg(AfgWaveform.of(drive), "drive.afg")
    >>> wave = read_afg("drive.afg")
    >>> float(wave.frequency_hz), float(wave.high_v)
    (10.0, 5.0)
    """
    with located(printable(path)):
        text = read_text(Path(path))
        lines = text.rstrip("\n").split("\n")
        if lines[0] != _AFG:
            raise DataError(f"line 1 must be '{_AFG}', but is '{printable(lines[0], 60)}'.")
        found = (re.fullmatch(r"# (\w+) = (\S+)", line) for line in lines[1:8])
        head = {m[1]: m[2] for m in found if m}
        if "code" not in lines[:8] or not {*_KEYS, "points"} <= head.keys():
            raise DataError(f"the header must give {', '.join(_KEYS)} and points, then `code`.")
        begin = lines.index("code") + 1
        numbers = _numbers([head[key] for key in (*_KEYS, "points")], 1, first_line=2)[:, 0]
        codes = _numbers(lines[begin : begin + POINTS + 1], 1, first_line=begin + 1)[:, 0]
        if codes.size != numbers[3] or not text.endswith("\n"):
            raise DataError(f"holds {codes.size} codes, but `points` is {numbers[3]:g}: cut short.")
        if (codes != np.rint(codes)).any() or codes.min() < 0 or codes.max() > FULL:
            raise DataError(
                f"codes are whole numbers from 0 to {FULL}, but these are not. Write it again."
            )
        return AfgWaveform(codes.astype(np.int64), numbers[1], numbers[2], numbers[0])


def _numbers(rows: list[str], columns: int, *, first_line: int) -> np.ndarray:
    if not any(rows):
        raise DataError("holds no samples. Export it again.")
    try:
        table = np.loadtxt(io.StringIO("\n".join(rows)), delimiter=",", ndmin=2, comments=None)
        if table.size == 0 or table.shape[1] != columns or not np.isfinite(table).all():
            raise ValueError("wrong shape")
    except ValueError as error:
        for i, row in enumerate(rows):
            try:
                good = len(row.split(",")) == columns and np.isfinite([*map(float, row.split(","))])
                if np.all(good):
                    continue
            except ValueError:
                pass
            raise DataError(
                f"line {i + first_line} must hold {columns} finite number(s), but is "
                f"'{printable(row, 40)}'. Export the file again."
            ) from error
        raise DataError("is not a table of numbers. Export it again.") from error
    return table
