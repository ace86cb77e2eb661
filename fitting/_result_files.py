"""The files of one result belong together: hashes in its JSON, which is written last.

While they are written, a list in its place says that they are not all there yet.
"""

import contextlib
import hashlib
import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fitting._json import json_text
from rapi_jax import DataError
from rapi_jax.io import OutputError, printable, write_atomic

LISTS = (
    "model.json",
    "diagnosis.json",
    "comparison.json",
    "certificate.json",
    "drives.json",
    "range.json",
    "population.json",
    "prediction.json",
)  # one of them in each result
UNFINISHED = "rapi.unfinished/1"
MANIFEST = "manifest.toml"
_LIMIT = 64 * 2**20  # bytes of such a list


def begin_result(folder: Path, name: str, files: Iterable[str]) -> list[str]:
    """Put a list of `files` that are not yet written in the place of the list `name`.

    Returns the names of what else an earlier result of that name has left in the folder, for
    `list_files`: they are no part of the new one. Where this fails, `OutputError` is raised and the
    earlier result is whole. What is there and is no part of an earlier result of that name is
    refused, see `check_output`.
    """
    files = set(files)
    check_output(folder, name, files, changed=True)
    earlier = [
        file
        for file in _listed(folder / name)[1]
        if file not in files and (folder / file).is_file()
    ]
    unwritten = dict.fromkeys([*sorted(files), *earlier])
    write_atomic(folder / name, json_text({"schema": UNFINISHED, "files": unwritten}))
    return earlier


def list_files(written: Iterable[Path], earlier: Iterable[str] = ()) -> dict[str, Any]:
    """The keys of a list of a result: `files`, the hashes of what was written.

    Where an earlier result has left others in the folder, they are named by `earlier_files`.
    """
    left = {"earlier_files": list(earlier)}
    return {"files": hash_files(written)} | (left if left["earlier_files"] else {})


def check_output(
    folder: Path, name: str, files: Iterable[str] = (), *, changed: bool = False
) -> None:
    """Raise `OutputError` where a result in `folder` would write over what is not its own.

    - `name`: of its list, such as `model.json`; `files`: the others that it writes, by name.
    - `changed`: whether files of an earlier result that were changed since may be replaced.

    Its own is what a list of that name, written by this package, names. A folder that holds a
    recording or fringe records is no place for a result: a run's file could have any name.
    """
    cure = "Choose another folder with `-o`, or move it away."
    if os.path.lexists(folder / MANIFEST):
        raise OutputError(
            f"the output {printable(folder)} is a recording or fringe records ({MANIFEST}), "
            f"which a result would mix with. {cure}"
        )
    table = folder / name
    schema, listed = _listed(table)
    if os.path.lexists(table) and not _is_ours(table):
        raise OutputError(f"the output {printable(table)} is there and is no result. {cure}")
    for file in sorted({*files} - {name}):
        path = folder / file
        if not os.path.lexists(path):
            continue
        if file not in listed:
            raise OutputError(
                f"the output {printable(path)} is there, and no {name} beside it says that it is "
                f"of an earlier result. {cure}"
            )
        wanted = listed[file] if schema != UNFINISHED else None
        if not changed and wanted is not None and wanted != hash_files([path])[file]:
            raise OutputError(
                f"the output {printable(path)} was changed after {name} was written, and is not "
                f"written over. {cure}"
            )


def _is_ours(path: Path) -> bool:
    """Whether the file is a JSON object with a schema of this package."""
    with contextlib.suppress(OSError, ValueError, RecursionError):
        if path.is_file() and path.stat().st_size <= _LIMIT:
            content = json.loads(path.read_text(encoding="utf-8"))
            return isinstance(content, dict) and str(content.get("schema")).startswith("rapi.")
    return False


def hash_files(paths: Iterable[Path]) -> dict[str, str]:
    """The SHA-256 of each file by its name, for the list of a result."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def check_belongs(path: Path) -> None:
    """Raise `DataError` where a list beside the file `path` says that it is of another result.

    Files that no list names are not looked at, but for a drive beside a certificate of others; one
    that is not there is left to its reader.
    """
    if not path.is_file():
        return
    drives = {name for name in listed_files(path.with_name("certificate.json")) if _is_drive(name)}
    if _is_drive(path.name) and drives and path.name not in drives:
        raise DataError(
            f"{printable(path)} is a drive that certificate.json beside it does not list: it is of "
            "another result. Keep it in a folder of its own."
        )
    for name in LISTS:
        if path.name == name:
            continue
        schema, files = _listed(path.with_name(name))
        if path.name not in files:
            continue
        label, wanted = printable(path), files[path.name]
        if schema == UNFINISHED:
            raise DataError(
                f"{label} is of a result that was not finished, as {name} beside it says: parts of "
                "two results may be mixed. Write the result again."
            )
        if wanted is None:
            raise DataError(
                f"{label} is of an earlier result than {name} beside it, which says nothing of it. "
                "Write its result again, into a folder of its own."
            )
        if wanted != hash_files([path])[path.name]:
            raise DataError(
                f"{label} is not the file that {name} beside it was written with: parts of two "
                "results are mixed. Write the result again, into an empty folder."
            )


def _is_drive(name: str) -> bool:
    return name.startswith("drive_") and "Hz." in name


def check_drive_unit(path: Path) -> None:
    """Raise `DataError` where the certificate of the drive `path` says that it is not in V."""
    _, files = _listed(path.with_name("certificate.json"))
    unit = "V"
    if path.name not in files:
        return
    with contextlib.suppress(OSError, ValueError, KeyError, TypeError, RecursionError):
        text = path.with_name("certificate.json").read_text(encoding="utf-8")
        unit = json.loads(text)["drive_unit"]
    if unit != "V":
        raise DataError(
            f"{printable(path)} is a drive in {printable(unit, 20)}, as certificate.json beside it "
            "says, and a generator gives V. Identify the laser from its drive in V."
        )


def listed_files(path: Path) -> set[str]:
    """The names in a list of this package; none where it is no such list."""
    return set(_listed(path)[1])


def _listed(path: Path) -> tuple[Any, dict[str, Any]]:
    """Schema and files of a list; nothing where it is not one of ours.

    A file that is not yet written, or is of an earlier result, has no hash.
    """
    with contextlib.suppress(OSError, ValueError, AttributeError, RecursionError):
        if path.is_file() and path.stat().st_size <= _LIMIT:
            content = json.loads(path.read_text(encoding="utf-8"))
            files = content.get("files")
            if isinstance(files, dict):
                earlier = content.get("earlier_files", [])
                left = [name for name in earlier if isinstance(name, str)]
                return content.get("schema"), dict.fromkeys(left) | files
    return None, {}
