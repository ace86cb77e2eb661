"""The recordings that paths on a command line name, and the name of each one's folder."""

import glob
import itertools
import os
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from fitting.batch.jobs._key import MANIFEST, MODEL
from rapi_jax import DataError
from rapi_jax.internal import read_toml
from rapi_jax.io import printable

FRINGES, RECORDING = "rapi.fringes/", "rapi.recording/"
_OTHER = {"fit": FRINGES, "diagnose": FRINGES, "range": RECORDING}  # schemas of another task's data
_LIMIT = 2**20  # bytes of a manifest


def find_recordings(task: str, given: Sequence[str]) -> list[str]:
    """What to do `task` on, in order: the paths themselves, what a glob matches, a folder's parts.

    Of a folder that is no recording: the recordings directly in it, by name (for "compensate" the
    models). One that does not read, or is damaged, is among them, and so is each of several paths.
    Raises `DataError` where a path is not there or nothing is found in it.
    """
    found: list[str] = []
    for text in given:
        if not os.path.lexists(text) and glob.has_magic(text):
            paths = sorted(glob.glob(text))
            parts = [part for path in paths for part in _parts(task, Path(path), alone=False)]
            missing = f"{printable(text)}: nothing matches."
        else:
            if not os.path.lexists(text):
                raise DataError(f"{printable(text)}: no such file or folder. Check the path.")
            parts = _parts(task, Path(text), alone=True) or [text] * (len(given) > 1)
            missing = f"{printable(text)}: no {_kind(task)} in this folder."
        if not parts:
            raise DataError(f"{missing} Give a folder of them, a glob, or their paths.")
        found += parts
    unique = {os.path.realpath(path): path for path in reversed(found)}
    return [path for path in found if unique[os.path.realpath(path)] is path]


def arrived(task: str, given: Sequence[str]) -> list[str]:
    """The same of folders that are watched: nothing found is no fault."""
    try:
        return find_recordings(task, given)
    except DataError:
        return []


def _parts(task: str, path: Path, *, alone: bool) -> list[str]:
    """`path` itself or, of a folder that is none of the task's, what is in it.

    `alone`: named by itself, so that a file of any kind was meant.
    """
    if path.name == MANIFEST:
        path = path.parent
    if path.is_file():
        return [str(path)] if alone or _is_file_of(task, path) else []
    if _is_folder_of(task, path):
        return [str(path)]
    inside = sorted(path.iterdir(), key=lambda one: one.name)
    return [
        str(one)
        for one in inside
        if not one.name.startswith(".")
        and (_is_folder_of(task, one) if one.is_dir() else _is_file_of(task, one))
    ]


def _is_file_of(task: str, path: Path) -> bool:
    suffix = {"fit": ".nc", "diagnose": ".nc", "compensate": ".rapi"}.get(task)
    return path.suffix == suffix and path.is_file()


def _is_folder_of(task: str, path: Path) -> bool:
    if task == "compensate":
        return (path / MODEL).exists()
    if not os.path.lexists(path / MANIFEST):
        return False
    try:
        schema = str(read_toml(path / MANIFEST, MANIFEST, _LIMIT).get("schema", ""))
    except (DataError, ValueError):
        return True  # to be listed with what is wrong with it
    return not schema.startswith(_OTHER[task])


def _kind(task: str) -> str:
    return {"compensate": "model", "range": "fringe records"}.get(task, "recording")


def name_jobs(paths: Iterable[str | Path], taken: Iterable[str] = ()) -> list[str]:
    """A folder name for each path, none twice: the last part of it; those of one name are numbered.

    A link gives its own name, which is the one that was typed, not that of what it leads to.
    `taken`: names that are given already.
    """
    plain = []
    for path in paths:
        whole = Path(os.path.abspath(path))
        name = whole.name if whole.is_dir() else whole.stem
        if whole.name == MODEL:
            name = whole.parent.name
        plain.append(name.lstrip(".") or "recording")
    several, used = Counter([*plain, *taken]), {*taken}
    used |= {name for name in plain if several[name] == 1}
    names = []
    for name in plain:
        if several[name] > 1:
            numbered = (f"{name}_{number}" for number in itertools.count(1))
            name = next(one for one in numbered if one not in used)
        used.add(name)
        names.append(name)
    return names
