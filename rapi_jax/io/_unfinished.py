"""The list of what an update of a folder writes and replaces, and its end where a kill ended it.

A folder is updated by new files under new names and a manifest that changes over to them. The list
lies beside them meanwhile, so that whoever writes there next knows which files nobody named.
"""

import contextlib
import json
import re
import secrets
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from rapi_jax._errors import DataError

from ._safe import MAX_MANIFEST, inside, read_text
from ._toml import MANIFEST, load_manifest

SUFFIX = ".update"  # of a list's file
_TABLES = {"run": ".csv", "record": ".npy"}  # what a manifest names files in
_MAX_LIST = 8 * MAX_MANIFEST  # it names the files of two manifests
_FRESH = re.compile(r".+-[0-9a-f]{8}\.(?:csv|npy)")


def fresh_names(files: Iterable[str]) -> list[str]:
    """Names for the new content of `files`, which no other writer takes."""
    token = secrets.token_hex(4)
    return [f"{file.rpartition('.')[0]}-{token}.{file.rpartition('.')[2]}" for file in files]


def named_files(folder: Path, *tables: str) -> set[str] | None:
    """The files that the manifest names in these of its tables; `None` where it cannot be read."""
    names: set[str] = set()
    try:
        manifest = load_manifest(folder, MANIFEST)
        for table in tables:
            files = [str(entry["file"]) for entry in manifest.get(table, [])]
            names |= {file for file in files if file.endswith(_TABLES[table])}
    except (DataError, OSError, TypeError, KeyError):
        return None
    return names


def update_list(folder: Path, *, fresh: Iterable[str], before: Iterable[str]) -> dict[str, Any]:
    """New files by their names; those of `before` with what tells them from others of that name."""
    files: dict[str, Any] = dict.fromkeys(fresh)
    for file in before:
        with contextlib.suppress(DataError, OSError):  # one that is missing needs no removal
            files[file] = _state(inside(folder, file))
    return files


def remove_unnamed(folder: Path, files: Mapping[str, Any]) -> bool:
    """Remove of the listed `files` in `folder` those that its manifest does not name.

    A file that was changed or replaced since it was listed stays, and so do all where the manifest
    cannot be read. Returns whether it could.
    """
    now = named_files(folder, *_TABLES)
    if now is None:
        return False
    for file in files.keys() - now:
        with contextlib.suppress(DataError, OSError):
            path = inside(folder, file)
            if _state(path) == files[file] or (files[file] is None and _FRESH.fullmatch(file)):
                path.unlink()
    return True


def finish_update(path: Path) -> bool:
    """Remove what the list at `path` says; whether it has served, and can be removed itself."""
    try:
        files = json.loads(read_text(path, _MAX_LIST))
    except (DataError, OSError, ValueError, RecursionError):
        return True  # broken off, so nothing was begun
    return not isinstance(files, dict) or remove_unnamed(path.parent, files)


def _state(path: Path) -> list[int]:
    status = path.lstat()
    return [status.st_size, status.st_mtime_ns]
