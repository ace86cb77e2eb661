"""An imported recording on the disk: whole or not at all, and over nothing that is not its own."""

import dataclasses
import os
from pathlib import Path

from rapi_jax._arguments import takes
from rapi_jax._errors import DataError
from rapi_jax.io._atomic import OutputError, write_atomic
from rapi_jax.io._leftovers import is_temporary
from rapi_jax.io._safe import StrPath, printable
from rapi_jax.io._toml import MANIFEST
from rapi_jax.io.recordings._read_write import read_recording, write_recording

from ._import import WRITER, Imported

PICTURE = "preview.png"


def check_output(path: StrPath) -> bool:
    """Refuse an output that is there and was not written by an import, or was changed since.

    Returns whether an earlier import is there, which `write_import` replaces. Raises `OutputError`.

    >>> from pathlib import Path
    >>> from rapi_jax.io import OutputError, check_output
    >>> Path("thesis").mkdir()
    >>> _ = Path("thesis/chapter.txt").write_text("text")
    >>> check_output("my-recording")
    False
    >>> try:
    ...     check_output("thesis")
    ... except OutputError as error:
    ...     print(error)
    the output thesis is there and is no recording. Choose another with `-o`.
    """
    target = Path(path)
    label = printable(path)
    cure = "Choose another with `-o`."
    if target.is_dir():
        if not any(target.iterdir()):
            return False
        if not (target / MANIFEST).exists():
            raise OutputError(f"the output {label} is there and is no recording. {cure}")
    elif not target.exists():
        _check_parent(target, label, cure)
        return False
    elif not os.fspath(path).endswith(".nc"):
        raise OutputError(f"the output {label} is there and is not a folder. {cure}")
    try:
        there = read_recording(target, nan="mask")
        made = there.provenance
    except DataError as error:
        raise OutputError(f"the output {label} is there and is no recording. {cure}") from error
    if made.get("imported_by") != WRITER:
        raise OutputError(
            f"the output {label} is there and is a recording that `rapi import` did not write. "
            f"{cure}"
        )
    if made.get("imported_sha256") != there.sha256():
        raise OutputError(
            f"the output {label} was changed after it was imported, and is not written over. {cure}"
        )
    if target.is_dir():
        own = {MANIFEST, PICTURE, *(entry.name for entry in target.glob("run*.csv"))}
        names = [entry.name for entry in target.iterdir() if not is_temporary(entry.name)]
        other = [name for name in names if name not in own]
        if other:
            raise OutputError(
                f"the output {label} also holds '{printable(other[0], 60)}', which `rapi import` "
                f"did not write. {cure}"
            )
    return True


def _check_parent(target: Path, label: str, cure: str) -> None:
    """Before anything is read: whether the folder that is to hold the output can be written to."""
    above = Path(os.path.realpath(target)).parent
    while not above.exists() and above != above.parent:
        above = above.parent
    if not above.is_dir() or not os.access(above, os.W_OK | os.X_OK):
        raise OutputError(
            f"cannot write to {printable(above)}, which is to hold the output {label}. {cure}"
        )


@takes(imported=Imported)
def write_import(imported: Imported, path: StrPath, *, picture: bytes | None = None) -> list[Path]:
    """Write the recording, and `picture` (a PNG) in it or beside it; the paths written.

    A folder with `manifest.toml` and a CSV file per run, or a netCDF-4 file where `path` ends in
    `.nc`. An earlier import at `path` is replaced, anything else is refused with `OutputError`.

    >>> import numpy as np
    >>> from rapi_jax.io import ImportOptions, import_recording, write_import
    >>> with open("scope.csv", "w") as file:
    ...     print("TIME (s),CH1 (V),CH2 (V)", file=file)
    ...     for k in range(400):
    ...         volt = 3.0 - 2.0 * np.cos(2 * np.pi * k / 100)
    ...         print(f"{k / 2000},{volt},{4.0 * volt}", file=file)
    >>> made = import_recording("scope.csv", ImportOptions(drive="CH1", response="CH2"))
    >>> [path.name for path in write_import(made, "my-recording")]
    ['my-recording']
    """
    again = check_output(path)
    recording, target = imported.recording, Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    provenance = recording.provenance | {"imported_sha256": recording.sha256()}
    whole = dataclasses.replace(recording, provenance=provenance)
    write_recording(whole, path, masked=True)  # gaps are asked for by `nan`, or told in the notes
    written = [target]
    place = target / PICTURE if target.is_dir() else target.with_suffix(f".{PICTURE}")
    if picture is not None and (again or not place.exists()):
        write_atomic(place, picture)
        written.append(place)
    return written
