"""The files of one result belong together: hashes in its JSON, which is written last.

While they are written, a list in its place says that they are not all there yet.
"""

import contextlib
import hashlib
import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from fitting._json import json_text
from rapi_jax import DataError
from rapi_jax.io import printable, write_atomic

LISTS = (
    "model.json",
    "diagnosis.json",
    "comparison.json",
    "certificate.json",
    "range.json",
    "population.json",
)  # one of them in each result
UNFINISHED = "rapi.unfinished/1"
_LIMIT = 64 * 2**20  # bytes of such a list


def begin_result(folder: Path, name: str, files: Iterable[str]) -> dict[str, str | None]:
    """Put a list of `files` that are not yet written in the place of the list `name`.

    Returns what else an earlier result of that name has left in the folder, to be listed as no part
    of the new one. Where this fails, `OutputError` is raised and the earlier result is whole.
    """
    files = set(files)
    earlier: dict[str, str | None] = {
        file: None
        for file in _listed(folder / name)[1]
        if file not in files and (folder / file).is_file()
    }
    unwritten = dict.fromkeys([*sorted(files), *earlier])
    write_atomic(folder / name, json_text({"schema": UNFINISHED, "files": unwritten}))
    return earlier


def hash_files(paths: Iterable[Path]) -> dict[str, str | None]:
    """The SHA-256 of each file by its name, for the list of a result."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def check_belongs(path: Path) -> None:
    """Raise `DataError` where a list beside the file `path` says that it is of another result.

    Files that no list names are not looked at; one that is not there is left to its reader.
    """
    if not path.is_file():
        return
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


def _listed(path: Path) -> tuple[Any, dict[str, Any]]:
    """Schema and files of a list; nothing where it is not one of ours."""
    with contextlib.suppress(OSError, ValueError, AttributeError, RecursionError):
        if path.is_file() and path.stat().st_size <= _LIMIT:
            content = json.loads(path.read_text(encoding="utf-8"))
            files = content.get("files")
            if isinstance(files, dict):
                return content.get("schema"), files
    return None, {}
