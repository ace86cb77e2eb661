"""Recordings that were imported apart as one: columns or sampling rates differed between them."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

from rapi_jax._errors import DataError
from rapi_jax.io._safe import StrPath, printable
from rapi_jax.io._units import UNITS_CHECKED
from rapi_jax.io.recordings._folder import MANIFEST
from rapi_jax.io.recordings._read_write import read_recording
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._response_source import FRINGES, RESPONSE_FROM, is_read_from_fringes
from rapi_jax.recording._run import Run

from ._options import ImportOptions
from ._repeats import check_repeats

_OF_A_RECORDING = {"response_origin", "nan", "max_samples"}  # options that say nothing of columns


def all_recordings(paths: Sequence[StrPath]) -> bool:
    """Whether all are folders of recordings. Raises `DataError` where only some are."""
    found = [(Path(path) / MANIFEST).is_file() for path in paths]
    if any(found) and not all(found):
        folder, table = paths[found.index(True)], paths[found.index(False)]
        raise DataError(
            f"{printable(folder)} is a recording, {printable(table)} is none. Import "
            f"{printable(table)} first, into a folder of its own, and then both folders."
        )
    return all(found)


def join_recordings(
    paths: Sequence[StrPath], options: ImportOptions
) -> tuple[Recording, list[str]]:
    """The runs of several recordings after each other, numbered anew, and what was assumed.

    Raises `DataError` where units or latencies differ, or an option is about columns.
    """
    _check_options(options)
    parts = [read_recording(path, nan=options.nan) for path in paths]
    names = [printable(path) for path in paths]
    for what in ("response_unit", "drive_unit", "response_lag_s"):
        values = [getattr(part, what) for part in parts]
        if len(set(values)) > 1:
            said = ", ".join(f"{v} in {n}" for v, n in zip(values, names, strict=True))
            raise DataError(f"the recordings differ in `{what}` ({said}). Import them alike.")
    own_zeros = any("run" in (part.response_origin, options.response_origin) for part in parts)
    runs: list[Run] = []
    sources: list[str] = []  # of each run
    notes: list[str] = []
    begin = 0.0
    for name, part in zip(names, parts, strict=True):
        first = min(run.drive.start_s for run in part.runs)
        notes.append(f"{name}: {len(part.runs)} run(s), from run{len(runs):02d} on")
        end = begin
        for run in part.runs:
            start = begin + run.drive.start_s - first
            end = max(end, start + float(run.drive.time[-1]))
            drive = dataclasses.replace(run.drive, start_s=start)
            runs.append(dataclasses.replace(run, drive=drive, name=f"run{len(runs):02d}"))
            sources.append(f"{name}, {run.name}")
        begin = end
    check_repeats(runs, sources)
    zeros = "have a zero of their own each" if own_zeros else "share one zero of the response"
    if len(parts) > 1:
        notes.append(
            "assumed: the recordings are of one device, follow each other without a pause, and "
            f"their runs {zeros}"
            + ("" if own_zeros else "; else give `--response-origin run`, or the shifts will be "
               "taken for drift")
        )  # fmt: skip
    provenance = {
        f"file{number:02d}": f"{name} data sha256 {part.sha256()[:16]}"
        for number, (name, part) in enumerate(zip(names, parts, strict=True))
    }
    confirmed = [part.provenance.get(UNITS_CHECKED, "").lower() for part in parts]
    provenance |= {UNITS_CHECKED: "true"} if "true" in confirmed else {}
    from_fringes = all(is_read_from_fringes(part.provenance) for part in parts)
    provenance |= {RESPONSE_FROM: FRINGES} if from_fringes else {}
    joined = dataclasses.replace(
        parts[0],
        runs=tuple(runs),
        response_origin="run" if own_zeros else "session",
        provenance=provenance,
    )
    return joined, notes


def _check_options(options: ImportOptions) -> None:
    plain = ImportOptions()
    said = [
        field.name
        for field in dataclasses.fields(options)
        if field.name not in _OF_A_RECORDING
        and getattr(options, field.name) != getattr(plain, field.name)
    ]
    if said:
        raise DataError(
            f"`{said[0]}` is said of a table, but folders of recordings are given. Give it where "
            "each table is imported, and join the folders without it."
        )
