"""The files of one result belong together: hashes in its JSON, which is written last."""

import contextlib
import hashlib
import json
from collections.abc import Iterable
from pathlib import Path

from rapi_jax import DataError
from rapi_jax.io import printable

LISTS = ("model.json", "diagnosis.json", "certificate.json")  # one of them in each result
_LIMIT = 64 * 2**20  # bytes of such a list


def begin_result(folder: Path, name: str) -> None:
    """Take away the list `name` of an earlier result, whose files are about to be written over."""
    (folder / name).unlink(missing_ok=True)


def hash_files(paths: Iterable[Path]) -> dict[str, str]:
    """The SHA-256 of each file by its name, for the list of a result."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


def check_belongs(path: Path) -> None:
    """Raise `DataError` where a list beside the file `path` was written with another one.

    Files that no list names are not looked at; one that is not there is left to its reader.
    """
    if not path.is_file():
        return
    for name in LISTS:
        listed = path.with_name(name)
        if listed == path or not listed.is_file() or listed.stat().st_size > _LIMIT:
            continue
        wanted = None
        with contextlib.suppress(ValueError, AttributeError):  # not a list of ours
            wanted = json.loads(listed.read_text(encoding="utf-8")).get("files", {}).get(path.name)
        if wanted is not None and wanted != hash_files([path])[path.name]:
            raise DataError(
                f"{printable(path)} is not the file that {name} beside it was written with: parts "
                "of two results are mixed. Write the result again, into an empty folder."
            )
