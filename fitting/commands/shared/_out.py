"""What commands share: the output folder, JSON, where people read."""

import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console


def output_folder(path: Path) -> Path:
    """`path` as a folder that exists and can be written to."""
    from rapi_jax.io import OutputError

    cure = "Choose another with `-o`."
    if path.exists() and not path.is_dir():
        raise OutputError(f"the output {path} is there and is not a folder. {cure}")
    try:
        path.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path):  # now, not after a long fit
            pass
    except OSError as error:
        raise OutputError(
            f"cannot write to the output folder {path}: {error.strerror}. {cure}"
        ) from error
    return path


def write_sent(sent: Mapping[str, bytes], output: Path, out: Console) -> None:
    """Write what a dry run would have sent, a file an instrument, and say where."""
    from rapi_jax.io import write_atomic

    folder = output_folder(output)
    for name, data in sent.items():
        write_atomic(folder / f"{name}.bytes", data)
    line = f"nothing was connected; what would be sent is in {folder}"
    out.print(line, markup=False, soft_wrap=True)


def print_json(value: Any) -> None:
    """One object on standard output."""
    from fitting._json import json_text

    sys.stdout.write(json_text(value))


def read_json(path: Path) -> Any:
    """The object in a file that was just written, to be printed as it stands there."""
    import json

    return json.loads(path.read_text(encoding="utf-8"))


def console(as_json: bool) -> Console:
    """Where people read: standard output, or standard error when that carries JSON."""
    return Console(stderr=as_json, highlight=False)
