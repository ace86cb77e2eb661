"""Files of other programs as one recording, with a record of what was done and assumed."""

import contextlib
import dataclasses
import hashlib
import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.io import _units
from rapi_jax.io._safe import StrPath, open_regular, printable
from rapi_jax.io.tables._read import choose_tables, read_tables
from rapi_jax.io.tables._table import Table
from rapi_jax.recording._drive import Drive
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._response_source import FRINGES, RESPONSE_FROM
from rapi_jax.recording._run import Run

from ._channels import Channels, read_channels
from ._clipping import describe_flat
from ._clock import even_clock, in_holes, is_even, resample
from ._decimate import decimate
from ._join import all_recordings, join_recordings
from ._options import ImportOptions
from ._repeats import check_repeats
from ._thresholds import THRESHOLDS
from .cleaning._clean import clean_drives
from .columns._command import import_command
from .fringes._read import FringeOptics, read_fringe_run
from .runs._cut import cut_record
from .runs._describe import describe_run
from .runs._overlap import without_overlap
from .runs._own_clocks import own_clocks
from .runs._repeating_response import describe_repeating
from .runs._skip import skip_start

WRITER = "rapi import"
IMPORT_COMMAND = "import_command"  # in the provenance: the line, without paths and output


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Imported:
    """A recording made from files; `notes`: what was found, done and assumed, a sentence each.

    >>> import numpy as np
    >>> from rapi_jax.io import ImportOptions, import_recording
    >>> with open("scope.csv", "w") as file:
    ...     print("TIME (s),CH1 (V),CH2 (V)", file=file)
    ...     for k in range(400):
    ...         volt = 3.0 - 2.0 * np.cos(2 * np.pi * k / 100)
    ...         print(f"{k / 2000},{volt},{4.0 * volt}", file=file)
    >>> made = import_recording("scope.csv", ImportOptions(drive="CH1", response="CH2"))
    >>> made.notes[0]
    "scope.csv: text, separated by commas; columns 0 'TIME (s)', 1 'CH1 (V)', 2 'CH2 (V)'"
    >>> repr(made).startswith("<Imported: <Recording: 1 run")
    True
    """

    recording: Recording
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        return f"<Imported: {self.recording!r}, {len(self.notes)} note(s)>"

    def __str__(self) -> str:
        return "\n".join([repr(self.recording), *(f"- {note}" for note in self.notes)])


def import_recording(
    files: Sequence[StrPath] | StrPath, options: ImportOptions | None = None
) -> Imported:
    """A recording from tables of other programs; nothing is written.

    Oscilloscopes' CSV files and other text, `.mat`, `.npy`, `.npz`, HDF5, netCDF-4, TDMS (with the
    package nptdms), JPK and Igor force curves (with the package afmformats). A record of several
    rates or swings is cut into runs of one each; several files follow each other in the order
    given. Folders of recordings are joined to one. `write_import` writes what comes back.

    Raises `DataError`, in one line with the file, where something is missing, wrong or damaged.

    >>> import numpy as np
    >>> from rapi_jax.io import ImportOptions, import_recording
    >>> with open("scope.csv", "w") as file:
    ...     print("TIME (s),CH1 (V),CH2 (V)", file=file)
    ...     for k in range(400):
    ...         volt = 3.0 - 2.0 * np.cos(2 * np.pi * k / 100)
    ...         print(f"{k / 2000},{volt},{4.0 * volt}", file=file)
    >>> columns = ImportOptions(
    ...     drive="CH1", response="CH2", response_scale=4.5, response_unit="GHz"
    ... )
    >>> (run,) = import_recording("scope.csv", columns).recording.runs
    >>> run.drive.excitation_hz, run.drive.waveform, round(run.span, 6)  # GHz
    (20.0, 'sine', 72.0)
    """
    options = options or ImportOptions()
    paths = [files] if isinstance(files, str | os.PathLike) else list(files)
    if not paths:
        raise ValueError("Argument `files` must name at least one file.")
    if options.drive_file is not None and len(paths) > 1:
        raise ValueError("`drive_file` goes with one file alone.")
    if all_recordings(paths):
        joined, said = join_recordings(paths, options)
        provenance = joined.provenance | {"imported_by": WRITER}
        provenance |= {f"import{k:02d}": printable(note, 1000) for k, note in enumerate(said)}
        return Imported(dataclasses.replace(joined, provenance=provenance), tuple(said))
    optics = _optics(options)  # refused before a long file is read
    runs: list[Run] = []
    sources: list[str] = []  # of each run
    notes: list[str] = []
    provenance: dict[str, str] = {"imported_by": WRITER}
    units: dict[tuple[str, str], str] = {}
    start, stamp, warm = 0.0, options.recorded_at, None
    for number, path in enumerate(paths):
        short = printable(Path(path).name)
        tables = choose_tables(read_tables(path), options.tables, short)
        first, begin, stated = len(notes), start, True
        spoken: list[tuple[str, list[str]]] = []
        for table in tables:
            if (since := _seconds_between(tables[0], table)) is None or begin + since < start:
                stated = False
            elif stated:
                start = begin + since
            channels = read_channels(table, str(path), options)
            units.setdefault((channels.drive_unit, channels.response_unit), table.label)
            stamp, warm = stamp or channels.recorded_at, warm or channels.temperature_c
            place = short + table.label.removeprefix(printable(path))
            found, said = _runs_at(table, channels, options, start, len(runs))
            runs += found
            sources += [place] * len(found)
            notes += [line for line in channels.notes if line not in notes]
            if channels.time_assumed:
                notes.append(_time_note(place, channels, found))
            spoken.append((place, said))
            start += float(channels.time[-1] - channels.time[0])
            provenance[f"columns{number:02d}"] = channels.columns
        if len(tables) > 1:
            order = (
                "their times are as the file states"
                if stated
                else "assumed: they follow each other without a pause"
            )
            text = f"{short}: {len(tables)} tables{_placed(tables[0].form)}, each as runs of its "
            notes.insert(first, f"{text}own; {order}{_one_zero(options)}")
        notes += _join_notes(short, spoken)
        provenance[f"file{number:02d}"] = f"{Path(path).name} sha256 {_digest(path)}"
    if len(units) > 1:
        said = "; ".join(f"{u[0]} and {u[1]} in {label}" for u, label in units.items())
        raise DataError(
            f"the files have different units ({said}). Import them apart, or give --drive-unit "
            "and --response-unit."
        )
    if len(paths) > 1:
        notes.append(
            "assumed: the files follow each other without a pause, in the order given"
            f"{_one_zero(options)}"
        )
    if optics is not None:
        way = "rises" if optics.sign > 0 else "falls"
        notes.append(
            "fringes tell changes of the optical frequency alone: each run has a zero of its own "
            f'(response_origin "run"); assumed: the frequency {way} with the drive'
        )
    check_repeats(runs, sources)
    (drive_unit, response_unit) = next(iter(units))
    runs, cleaned = clean_drives(runs, options.drive_as, drive_unit)
    runs, fewer = decimate(runs, options.decimate, options.max_samples)
    notes += cleaned + fewer
    provenance |= _command_by_names(paths, options)
    provenance |= {"recorded_at": stamp} if stamp else {}
    provenance |= {_units.UNITS_CHECKED: "true"} if options.units_checked else {}
    provenance |= {"temperature_c": warm} if warm else {}
    provenance |= {} if optics is None else {RESPONSE_FROM: FRINGES}
    provenance |= {f"import{k:02d}": printable(note, 1000) for k, note in enumerate(notes)}
    recording = Recording(
        tuple(runs),
        response_unit=response_unit,
        drive_unit=drive_unit,
        response_origin=options.response_origin if optics is None else "run",
        response_lag_s=options.response_lag_s,
        provenance=provenance,
    )
    _units.check_plausible(recording)
    return Imported(recording, tuple(notes))


def _command_by_names(paths: Sequence[StrPath], options: ImportOptions) -> dict[str, str]:
    """The line that imports the same, from the folder of the files: a manifest holds no paths.

    None where a name is not printable, or the files are too many for one line.
    """
    if options.drive_file is not None:
        options = dataclasses.replace(options, drive_file=Path(options.drive_file).name)
    line = import_command([Path(path).name for path in paths], options)
    return {IMPORT_COMMAND: line} if line == printable(line, 4000) else {}


def _time_note(place: str, channels: Channels, runs: Sequence[Run]) -> str:
    """That a time without a unit is taken to be in s, and what follows for the rates."""
    rates = list(dict.fromkeys(f"{run.drive.rate:.6g}" for run in runs if run.drive.rate))
    step = float(channels.time[-1] - channels.time[0]) / (channels.time.size - 1)
    follows = f"a sampling rate of {1.0 / step:.6g} Hz" if step > 0 else ""
    if rates:
        follows += f" and a drive of {', '.join(rates[:4])} Hz"
    return (
        f"{place}: assumed: the time is in s, as no unit is given; that makes {follows}. If it is "
        "in another unit, say so: --time-unit ms"
    )


def _placed(form: str) -> str:
    """Where the tables of a file stand."""
    if form == "MATLAB":
        return " (elements of a structure array, or columns of matrices of one shape)"
    return " below each other"


def _one_zero(options: ImportOptions) -> str:
    """What is assumed of the zeros of runs of several tables; a shift would look like drift."""
    if options.measured == "fringes" or options.response_origin == "run":
        return ""
    return (
        ", and share one zero of the response; of measurements with a zero of their own each, give "
        "`--response-origin run`, or the shifts will be taken for drift"
    )


def _join_notes(short: str, spoken: list[tuple[str, list[str]]]) -> list[str]:
    """What was said of the tables of a file; what holds of each of several, once."""
    lines = spoken[0][1] if len(spoken) > 1 else []
    shared = [line for line in lines if all(line in said for _, said in spoken)]
    apart = [f"{place}: {line}" for place, said in spoken for line in said if line not in shared]
    return apart + [f"{short}, each table: {line}" for line in shared]


def _seconds_between(first: Table, table: Table) -> float | None:
    """From one table to another, by the times that the file states; `None` where it does not."""
    if first.began is None or table.began is None:
        return None
    return (table.began - first.began).total_seconds()


def _runs_at(
    table: Table, channels: Channels, options: ImportOptions, start_s: float, number: int
) -> tuple[list[Run], list[str]]:
    """The runs of one table, at the rate that it states where its drive has that rate."""
    if table.rate_hz is not None and not options.rates:
        with contextlib.suppress(DataError):
            own = dataclasses.replace(options, rates=(table.rate_hz,))
            runs, said = _runs_of(channels, own, table.label, start_s, number)
            return runs, ["its rate is as the file states", *said]
    return _runs_of(channels, options, table.label, start_s, number)


def _runs_of(
    channels: Channels, options: ImportOptions, label: str, start_s: float, number: int
) -> tuple[list[Run], list[str]]:
    """The runs of one file, named from `number` on; its first sample is at `start_s`."""
    time, drive, response = channels.time, channels.drive, channels.response
    time, stretches, notes = even_clock(time, label)
    optics = _optics(options)
    if optics is None and len(stretches) == 1 and (uneven := is_even(time)):
        if (parts := own_clocks(time, drive)) is not None:
            time, stretches, notes = parts
        else:
            again = int((np.diff(time) == 0.0).sum())
            read = time
            time, (drive, response), step, averaged = resample(read, [drive, response])
            stretches = [(0, time.size)]
            if (missing := in_holes(time, read, step)).any():
                response = np.where(missing, np.nan, response)
                notes.append(
                    f"{int(missing.sum())} of the even samples lie where the file has none for "
                    f"more than {THRESHOLDS.hole:g} steps: no reading is put there, and the drive "
                    "is interpolated"
                )
            if again:
                notes.append(
                    f"{again} sample(s) have the time of the one before them: of each such time "
                    "the first sample is kept, the others are left out"
                )
            notes.append(
                f"sampling is uneven ({uneven}); both are resampled to every {step:.6g} s"
                + (f", which averages up to {averaged} samples and lowers the noise of both there"
                   if averaged > 1 else "")
            )  # fmt: skip
    runs: list[Run] = []
    begins: list[int] = []  # of each run, its first sample
    for a, b in stretches:
        if b - a < 3:
            notes.append(f"dropped {b - a} sample(s) between two gaps")
            continue
        if uneven := is_even(time[a:b]):
            raise DataError(f"{label}: samples {a} to {b - 1}: {uneven}. Cut the file there.")
        part = slice(a, b)
        step = float(time[b - 1] - time[a]) / (b - 1 - a)
        pieces, said = cut_record(drive[part], step, options, label)
        if optics is not None:  # fringes of another rate would be too fast for those of this one
            pieces = without_overlap(pieces, drive[part], step)
        place = f"samples {a}-{b - 1}: " if len(stretches) > 1 else ""
        for piece in pieces:
            rows = slice(a + piece.first, a + piece.last + 1)
            begin = float(time[rows][0])
            one = Drive(
                time[rows] - begin,
                drive[rows],
                piece.excitation_hz,
                piece.waveform,
                start_s + begin - float(time[0]),
            )
            name = f"run{number + len(runs):02d}"
            try:
                one, skipped, left_out = skip_start(one, name, options)
            except DataError as error:
                raise DataError(f"{label}: {error}") from error
            rows = slice(rows.start + skipped, rows.stop)
            begins.append(rows.start)
            notes += [describe_run(one, name, rows.start, channels.drive_unit), *left_out]
            if optics is None:
                runs.append(Run(one, response[rows], name))
                continue
            cavity = None if channels.cavity is None else channels.cavity[rows]
            try:
                run, lines = read_fringe_run(one, response[rows], cavity, optics, name)
            except DataError as error:
                raise DataError(f"{label}: {name}: {error}") from error
            runs.append(run)
            notes += lines
        notes += [place + line for line in said]
    if not runs:
        raise DataError(
            f"{label}: no stretch without a gap is long enough for a run. Record again."
        )
    placed = list(zip(runs, begins, strict=True))
    notes += [] if options.made is not None else describe_flat("drive", placed, _drive_of)
    if optics is None:
        notes += describe_flat("response", placed, _response_of)
        notes += describe_repeating(runs)
    return runs, notes


def _drive_of(run: Run) -> np.ndarray:
    return run.drive.value


def _response_of(run: Run) -> np.ndarray:
    return run.response


def _optics(options: ImportOptions) -> FringeOptics | None:
    if options.interferometer is None:
        return None
    sign = options.response_scale
    return FringeOptics.of(options.interferometer, options.cavity_spacing, sign)


def _digest(path: StrPath) -> str:
    digest = hashlib.sha256()
    with open_regular(path) as file:
        while block := file.read(2**20):
            digest.update(block)
    return digest.hexdigest()[:16]
