"""`manifest.toml` of a folder: read from files that are not trusted, and written."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from rapi_jax._errors import DataError

from ._safe import MAX_MANIFEST, cause, inside, located, read_text

MANIFEST = "manifest.toml"
_MAX_DOTS = 64
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"|' + r"'[^']*'")


def load_manifest(folder: Path, label: str) -> dict[str, Any]:
    """The table in a folder's manifest. Raises `DataError` that begins with `label`."""
    with located(label):
        path = inside(folder, MANIFEST)
    text = read_text(path, MAX_MANIFEST)
    whole = '"""' in text or "'''" in text
    for i, line in enumerate(text.split("\n")):
        # A key of n dots costs tomllib n^2 of memory: 200 KB of dots would take all there is.
        if (line if whole else _STRING.sub("", line)).count(".") > _MAX_DOTS:
            raise DataError(f"{label}: line {i + 1} has over {_MAX_DOTS} dots. Shorten its keys.")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise DataError(f"{label}: not valid TOML ({cause(error)}). Correct that line.") from error


def toml_value(value: Any) -> str:
    """A string, a number, a truth value or a list of them as TOML writes it."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml_value, value))}]"
    if not isinstance(value, str):
        return repr(value)
    # JSON text is a TOML string but for DEL; quotes in pairs would look like a multi-line string.
    text = json.dumps(value, ensure_ascii=False)
    return text.replace("\x7f", "\\u007f").replace("'", "\\u0027")
