"""Where a bench may write what it takes: over what a bench wrote there before, and nothing else."""

import json
import os
from hashlib import sha256
from pathlib import Path

_CURE = "Choose another with `-o`, or move it away."


def check_recording_output(path: Path) -> None:
    """Refuse an output that is there and that `rapi measure` did not write: `OutputError`."""
    from rapi_jax import DataError
    from rapi_jax.io import OutputError, printable, read_recording

    if _is_free(path):
        return
    label = printable(path)
    try:
        made = read_recording(path, nan="mask").provenance
    except DataError as error:
        raise OutputError(
            f"the output {label} is there and is no recording that reads. {_CURE}"
        ) from error
    if "bench" not in made and made.get("incomplete") is None:
        raise OutputError(
            f"the output {label} is a recording that `rapi measure` did not write. {_CURE}"
        )


def check_fringes_output(path: Path) -> None:
    """Refuse a folder that is there and holds no fringe records. Raises `OutputError`."""
    from rapi_jax import DataError
    from rapi_jax.internal import read_toml
    from rapi_jax.io import OutputError, printable

    if path.exists() and not path.is_dir():
        raise OutputError(
            f"the output {printable(path)} is there and is not a folder. Choose another."
        )
    if _is_free(path):
        return
    try:
        schema = read_toml(path / "manifest.toml", "manifest.toml").get("schema")
    except DataError:
        schema = None
    if not str(schema).startswith("rapi.fringes/"):
        raise OutputError(
            f"the output {printable(path)} is there and holds no fringe records. {_CURE}"
        )
    settings = path / "settings.json"
    if os.path.lexists(settings) and not _is_settings(settings):
        raise OutputError(
            f"the output {printable(settings)} is there and holds no settings of a bench. {_CURE}"
        )


def check_sent_output(path: Path) -> None:
    """Refuse a folder that holds anything but the bytes of a dry run. Raises `OutputError`."""
    from rapi_jax.io import OutputError, printable

    if not path.is_dir():
        return
    others = sorted(one.name for one in path.iterdir() if one.suffix != ".bytes")
    if others:
        raise OutputError(
            f"the output {printable(path)} holds {printable(others[0], 80)}, which is not of a dry "
            f"run. {_CURE}"
        )


_SEAL = "# Written by `rapi bench serve`, sha256 of all above: "


def sealed(text: str) -> str:
    """The text of a bench file, with a last line by which a change of it is seen."""
    return f"{text}{_SEAL}{sha256(text.encode()).hexdigest()}\n"


def check_bench_output(path: Path) -> None:
    """Refuse a bench file that is there and is of no simulated laboratory, or was changed since.

    Raises `OutputError`. Limits that somebody has set are not lost.
    """
    from rapi_jax import DataError
    from rapi_jax.internal import read_text
    from rapi_jax.io import OutputError, printable

    if not path.exists():
        return
    try:
        text = read_text(path, 2**20)
    except DataError:
        text = "?"
    if text and not text.startswith("# A simulated la"):
        raise OutputError(
            f"the output {printable(path)} is there and describes no simulated laboratory. Choose "
            "another name, or move it away."
        )
    above, seal, digest = text.rpartition(_SEAL)
    if seal and sha256(above.encode()).hexdigest() != digest.strip():
        raise OutputError(
            f"the output {printable(path)} was changed since `rapi bench serve` wrote it, its "
            "limits perhaps. Choose another name, or move it away."
        )


def _is_settings(path: Path) -> bool:
    """Whether it is settings of instruments by family, as a bench tells them."""
    from rapi_jax import DataError
    from rapi_jax.internal import read_text

    try:
        content = json.loads(read_text(path, 2**24))
    except (DataError, ValueError, RecursionError):
        return False
    families = ("generator", "digitizer", "laser")
    return isinstance(content, dict) and all(
        name in families and isinstance(one, dict) for name, one in content.items()
    )


def _is_free(path: Path) -> bool:
    return not path.exists() or (path.is_dir() and not any(path.iterdir()))
