"""Where a result comes from: command, options, inputs with their hashes, and all versions."""

import importlib.metadata
import platform
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

_NOT_OPTIONS = {"output", "json"}
_REQUIREMENT = re.compile(r"[A-Za-z0-9._-]+")


def provenance(command: str, options: Mapping[str, Any], inputs: Sequence[str]) -> dict[str, Any]:
    """What a result's JSON holds under `provenance`.

    **Arguments:**

    - `command`: as it is typed, such as `rapi fit`. `options`: all arguments of it, by name.
    - `inputs`: which of `options` are inputs; each path among the other options is one, too.

    `options_file` is the `rapi.toml` that was read, null without one.

    Inputs are listed by path and SHA-256: of a file; of a recording's manifest and the files that
    it names; of a folder's model.
    """
    from fitting.batch.jobs._key import content_sha256
    from fitting.commands.shared._options_file import describe_options_file

    paths = [path for value in options.values() for path in _paths(value)]
    if isinstance(options.get("output"), Path):
        paths.remove(options["output"])
    return {
        "command": command,
        "options": {
            name: _plain(value)
            for name, value in options.items()
            if name not in _NOT_OPTIONS and name not in inputs
        },
        "options_file": describe_options_file(command, options),
        "inputs": [{"path": str(path), "sha256": content_sha256(path)} for path in paths],
        "versions": all_versions(),
    }


def all_versions() -> dict[str, str]:
    """Version of this package, of Python, and of each package that it requires and is installed."""
    requires = importlib.metadata.requires("rapi-jax") or []
    names = [found[0] for line in requires if (found := _REQUIREMENT.match(line))]
    versions = {"python": platform.python_version(), "platform": platform.platform()}
    for name in ["rapi-jax", "jaxlib", *dict.fromkeys(names)]:
        try:
            versions[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            continue  # of an extra
    return versions


def _paths(value: Any) -> list[Path]:
    if isinstance(value, Path):
        return [value]
    if isinstance(value, tuple | list):
        return [path for item in value for path in _paths(item)]
    return []


def _plain(value: Any) -> Any:
    if isinstance(value, tuple | list):
        return [_plain(item) for item in value]
    return value if value is None or isinstance(value, bool | int | float) else str(value)
