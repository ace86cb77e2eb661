"""The key of a job: a hash of all that decides its result."""

import dataclasses
import functools
import hashlib
import importlib.metadata
import importlib.util
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fitting._versions import package_versions
from fitting.batch.jobs._job import Job
from rapi_jax import DataError
from rapi_jax.internal import inside, open_regular, read_toml

MANIFEST, MODEL = "manifest.toml", "model.rapi"
_PACKAGES = ("rapi_jax", "fitting")
_ALSO = ("jaxlib", "lineax", "scipy")
_LIMIT, _BLOCK = 2**20, 2**20  # bytes: of a manifest, read at once


def with_key(job: Job) -> Job:
    """The job with its key."""
    if job.key:
        return job
    return dataclasses.replace(job, key=job_key(job.task, job.options, job.path))


def job_key(task: str, options: Mapping[str, Any], path: Path) -> str:
    """SHA-256 of task, options, data and code.

    A path among the options counts by its content.
    """
    values = {name: _content(value) for name, value in options.items()}
    about = [task, values, content_sha256(path), code_sha256()]
    return hashlib.sha256(json.dumps(about, sort_keys=True).encode()).hexdigest()


def _content(value: Any) -> Any:
    if isinstance(value, Path):
        return content_sha256(value)
    if isinstance(value, tuple | list):
        return [_content(item) for item in value]
    return value


def content_sha256(path: Path) -> str:
    """SHA-256 of a file; of a recording's manifest and the files it names; of a folder's model.

    What cannot be read counts as missing, so that it is another content once it can.
    """
    digest = hashlib.sha256()
    for file in named_files(path) if path.is_dir() else [path]:
        digest.update(json.dumps([file.name, _file_sha256(file)]).encode())
    return digest.hexdigest()


def named_files(folder: Path) -> list[Path]:
    """The files that a folder's content consists of: its manifest and what that names, or a model.

    A manifest that does not read stands alone.
    """
    if not (folder / MANIFEST).exists():
        return [folder / MODEL]
    try:
        table = read_toml(folder / MANIFEST, MANIFEST, _LIMIT)
        entries = [*table.get("run", ()), *table.get("record", ())]
        return [folder / MANIFEST, *(inside(folder, entry["file"]) for entry in entries)]
    except (DataError, ValueError, TypeError, KeyError, AttributeError):
        return [folder / MANIFEST]


def _file_sha256(path: Path) -> str | None:
    try:
        digest = hashlib.sha256()
        with open_regular(path) as file:
            while block := file.read(_BLOCK):
                digest.update(block)
        return digest.hexdigest()
    except (DataError, OSError):
        return None


@functools.cache
def code_sha256() -> str:
    """SHA-256 of the source files of `rapi_jax` and `fitting`, and of the versions they run on."""
    digest = hashlib.sha256()
    for package in _PACKAGES:
        found = importlib.util.find_spec(package)
        if found is None or found.origin is None:
            raise ImportError(f"{package} has no source files here")
        root = Path(found.origin).parent
        for path in sorted(root.rglob("*.py")):
            digest.update(json.dumps([package, path.relative_to(root).as_posix()]).encode())
            digest.update(hashlib.sha256(path.read_bytes()).digest())
    versions = package_versions() | {name: importlib.metadata.version(name) for name in _ALSO}
    digest.update(json.dumps(versions, sort_keys=True).encode())
    return digest.hexdigest()
