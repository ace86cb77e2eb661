"""What commands share: the output folder, JSON, where people read."""

import contextlib
import os
import sys
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from rich.console import Console


def output_folder(path: Path) -> Path:
    """`path` as a folder that exists and can be written to."""
    from rapi_jax.internal import cause
    from rapi_jax.io import OutputError, printable

    cure = "Choose another with `-o`."
    label = printable(path)
    try:
        if path.exists() and not path.is_dir():
            raise OutputError(f"the output {label} is there and is not a folder. {cure}")
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):  # now, not after a long fit
            pass
    except OutputError:
        raise
    except (OSError, ValueError) as error:  # ValueError: a NUL in the path
        raise OutputError(
            f"cannot write to the output folder {label}: {cause(error)}. {cure}"
        ) from error
    return path


def check_output_folder(path: Path) -> None:
    """Raise as `output_folder` does, before any work; a folder that was not there is not left."""
    new = _missing_folders(path)
    output_folder(path)
    _remove_empty(new)


def _missing_folders(path: Path) -> list[Path]:
    return [one for one in (path, *path.parents) if not os.path.exists(one)]


def _remove_empty(folders: list[Path]) -> None:
    with contextlib.suppress(OSError, ValueError):  # from one that is not empty on, they stay
        for one in folders:
            one.rmdir()


@contextlib.contextmanager
def output_kept_if_written(path: Path) -> Iterator[Path]:
    """As `output_folder`, for what may be refused: folders that it made and left empty are removed.

    They are where what is written under it failed.
    """
    new = _missing_folders(path)
    try:
        yield output_folder(path)
    except BaseException:
        _remove_empty(new)
        raise


def write_sent(sent: Mapping[str, bytes], output: Path, out: Console) -> None:
    """Write what a dry run would have sent, a file an instrument, and say where."""
    from rapi_jax.io import write_atomic

    folder = output_folder(output)
    for name, data in sent.items():
        write_atomic(folder / f"{name}.bytes", data)
    line = f"nothing was connected; what would be sent is in {folder}"
    out.print(line, markup=False, soft_wrap=True)


def print_json(value: Any) -> None:
    """One object on standard output; letters that its encoding lacks are escaped as JSON does."""
    import json

    from fitting._json import json_text

    text = json_text(value)
    try:
        text.encode(getattr(sys.stdout, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        text = json.dumps(value, indent=1, allow_nan=False) + "\n"
    sys.stdout.write(text)


def read_json(path: Path) -> Any:
    """The object in a file that was just written, to be printed as it stands there."""
    import json

    return json.loads(path.read_text(encoding="utf-8"))


class _PipedConsole(Console):
    """A console that leaves it to `run` what a reader that went away means."""

    def on_broken_pipe(self) -> None:
        """Raise on; rich would end the process with code 1."""
        raise BrokenPipeError


def console(as_json: bool) -> Console:
    """Where people read: standard output, or standard error when that carries JSON."""
    return _PipedConsole(stderr=as_json, highlight=False)
