"""A recording as a folder: `manifest.toml` beside one CSV file per run."""

import contextlib
import errno
import os
import shutil
from collections import Counter
from pathlib import Path

from rapi_jax._errors import DataError
from rapi_jax.io import _units
from rapi_jax.io._atomic import output_error, sync, sync_folder, write_atomic
from rapi_jax.io._leftovers import remove_leftovers, temporary_name
from rapi_jax.io._replacement import replacing
from rapi_jax.io._safe import MAX_BYTES, MAX_MANIFEST, StrPath, inside, located, printable
from rapi_jax.io._toml import MANIFEST, load_manifest, toml_value
from rapi_jax.io._unfinished import fresh_names
from rapi_jax.recording._recording import Recording

from . import _csv
from ._build import NanPolicy, build_run


def read_folder(folder: Path, *, nan: NanPolicy) -> Recording:
    """Read the folder. Raises `DataError` with the file, the line or sample, and the cure."""
    from ._manifest import parse_manifest

    label = printable(folder / MANIFEST)
    if not os.path.lexists(folder / MANIFEST):
        if model := next(iter(sorted(folder.glob("*.rapi"))), None):
            raise DataError(
                f"{printable(folder)}: this folder holds a model, {printable(model.name)}, and no "
                "recording: are the recording and the model exchanged? A recording is a folder "
                f"with a {MANIFEST}, or a netCDF file."
            )
        raise DataError(
            f"{printable(folder)}: no {MANIFEST} in this folder, so it is no recording"
            f"{_contents(folder)}. `rapi import FILE... -o my-recording` makes one from files of "
            "an oscilloscope or another program."
        )
    table = load_manifest(folder, label)
    with located(label):
        manifest = parse_manifest(table)
        paths = [inside(folder, entry.file) for entry in manifest.run]
        names = [Path(e.file).stem if e.name is None else e.name for e in manifest.run]
        _check_files(paths, names)
    runs = []
    for entry, path, name in zip(manifest.run, paths, names, strict=True):
        place = printable(path)
        run = build_run(
            _csv.read_columns(path, place, entry.samples),
            label=place,
            name=name,
            drive_unit=manifest.drive_unit,
            response_unit=manifest.response_unit,
            excitation_hz=entry.excitation_hz,
            waveform=entry.waveform,
            start_s=entry.start_s,
            nan=nan,
            missing=entry.missing_readings,
        )
        runs.append(run)
    with located(label):
        return Recording(
            tuple(runs),
            response_unit=_units.response_unit(manifest.response_unit)[0],
            drive_unit=_units.drive_unit(manifest.drive_unit)[0],
            response_origin=manifest.response_origin,
            response_lag_s=float(manifest.response_lag_s),
            provenance=manifest.all_provenance([run.name for run in runs]),
        )


def _check_files(paths: list[Path], names: list[str]) -> None:
    """Refuse two runs of one name or file, and files that together are larger than one may be.

    Before the first is read: a small manifest could name one large file ten thousand times.
    """
    if len(set(names)) < len(names):
        twice = next(name for name, count in Counter(names).items() if count > 1)
        raise DataError(f"two runs have the same name, '{printable(twice, 60)}'. Rename one.")
    seen: dict[Path, int] = {}
    sizes: dict[str, int] = {}
    for number, path in enumerate(paths):
        first = seen.setdefault(path.resolve(), number)
        if first != number:
            raise DataError(
                f"[[run]] {first} and {number} name one file, '{printable(path.name)}'. Give each "
                "run a file of its own, or name the file once."
            )
        with contextlib.suppress(OSError):  # one that is missing is told when it is read
            sizes[str(path)] = path.stat().st_size
    total = sum(sizes.values())
    if total > MAX_BYTES:
        largest = printable(Path(max(sizes, key=sizes.__getitem__)).name)
        raise DataError(
            f"the files of all runs, the largest '{largest}', "
            f"have {total} bytes, but at most {MAX_BYTES} are read. Split the recording, or sample "
            "it less densely."
        )


def _manifest_text(recording: Recording, files: list[str], masked: bool) -> str:
    from ._manifest import head

    whole, entries = head(recording, masked=masked)
    lines = [f"{key} = {toml_value(value)}" for key, value in whole.items()]
    for file, entry, run in zip(files, entries, recording.runs, strict=True):
        lines += ["", "[[run]]", f"file = {toml_value(file)}", f"samples = {run.drive.size}"]
        lines += [
            f"{key} = {toml_value(value)}"
            for key, value in entry.items()
            if not (key == "name" and value == Path(file).stem)
        ]
    if recording.provenance:
        lines += ["", "[provenance]"]
        lines += [
            f"{toml_value(key)} = {toml_value(value)}"
            for key, value in recording.provenance.items()
        ]
    text = "\n".join(lines) + "\n"
    if len(text.encode()) > MAX_MANIFEST:
        raise DataError(f"{MANIFEST} would exceed {MAX_MANIFEST} bytes. Shorten `provenance`.")
    return text


def _write_runs(recording: Recording, folder: Path, files: list[str]) -> None:
    for run, file in zip(recording.runs, files, strict=True):
        path = folder / file
        text = _csv.write_columns((run.drive.time, run.drive.value, run.response))
        path.write_text(text, encoding="utf-8", newline="\n")
        sync(path)
    sync_folder(folder)


def _contents(folder: Path) -> str:
    """What a folder that is no recording holds, for somebody who took the wrong one."""
    try:
        names = sorted(entry.name for entry in os.scandir(folder))
    except OSError:
        return ""
    if not names:
        return " (it is empty)"
    more = f" and {len(names) - 3} more" if len(names) > 3 else ""
    return f" (it holds {', '.join(printable(name, 40) for name in names[:3])}{more})"


def write_folder(recording: Recording, path: StrPath, *, masked: bool = False) -> None:
    """Write the folder whole, or leave what was there. Raises `OutputError`.

    A new folder appears by one rename. In a folder with files, new CSV files get new names and the
    manifest, replaced last, changes over to them; those of the old manifest are removed after that.
    Where a kill comes between, the next write into the folder removes what is not named. `masked`:
    see `write_recording`.
    """
    target = Path(os.path.realpath(path))
    files = [f"{run.name}.csv" for run in recording.runs]
    manifest = _manifest_text(recording, files, masked)  # refuses before anything is touched
    remove_leftovers(target.parent)
    staging = target.with_name(temporary_name())
    try:
        if target.exists() and not target.is_dir():
            raise NotADirectoryError(errno.ENOTDIR, "it is there and is not a folder")
        if not target.exists() or not any(target.iterdir()):
            try:
                staging.mkdir()
                write_atomic(staging / MANIFEST, manifest)
                _write_runs(recording, staging, files)
                os.rename(staging, target)
                sync_folder(target.parent)
                return
            except OSError as error:  # another process made it meanwhile: go on as if it had been
                if error.errno not in (errno.ENOTEMPTY, errno.EEXIST):
                    raise
            finally:
                shutil.rmtree(staging, ignore_errors=True)
        _update(recording, target, masked)
    except OSError as error:
        raise output_error(path, error) from error


def _update(recording: Recording, folder: Path, masked: bool) -> None:
    files = fresh_names(f"{run.name}.csv" for run in recording.runs)
    manifest = _manifest_text(recording, files, masked)
    with replacing(folder, "run", files):
        _write_runs(recording, folder, files)
        write_atomic(folder / MANIFEST, manifest)
