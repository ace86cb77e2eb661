"""TOML of files that are not trusted, a folder's `manifest.toml` among them; and what writes it."""

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from rapi_jax._errors import DataError

from ._safe import MAX_MANIFEST, StrPath, cause, inside, located, read_text

MANIFEST = "manifest.toml"
_MAX_DOTS = 64
_STRING = re.compile(r'"(?:[^"\\]|\\.)*"|' + r"'[^']*'")


def load_manifest(folder: Path, label: str) -> dict[str, Any]:
    """The table in a folder's manifest. Raises `DataError` that begins with `label`."""
    with located(label):
        path = inside(folder, MANIFEST)
    return parse_toml(read_text(path, MAX_MANIFEST), label)


def read_toml(path: StrPath, label: str, max_bytes: int = MAX_MANIFEST) -> dict[str, Any]:
    """The table in a TOML file of at most `max_bytes`. Raises `DataError` that names the file.

    `label`: put in front where the text is no TOML, as in `parse_toml`.
    """
    return parse_toml(read_text(path, max_bytes), label)


def parse_toml(text: str, label: str) -> dict[str, Any]:
    """The table in TOML text that is not trusted. Raises `DataError` that begins with `label`.

    Text that would take far more memory or depth than its length, or holds an integer beyond what
    Python reads, is refused in the same words as a mistake.
    """
    whole = '"""' in text or "'''" in text
    for i, line in enumerate(text.split("\n")):
        # A key of n dots costs tomllib n^2 of memory: 200 KB of dots would take all there is.
        if (line if whole else _STRING.sub("", line)).count(".") > _MAX_DOTS:
            raise DataError(f"{label}: line {i + 1} has over {_MAX_DOTS} dots. Shorten its keys.")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        what = "an integer has too many digits" if "int_max_str" in str(error) else cause(error)
        raise DataError(f"{label}: not valid TOML ({what}). Correct that line.") from error


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
