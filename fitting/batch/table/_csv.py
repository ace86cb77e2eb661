"""A table as CSV text that a spreadsheet does not run and a terminal does not obey."""

import re
from collections.abc import Sequence

from rapi_jax.io import printable

from ._columns import Column
from ._figures import Figure

_LONGEST = 2000  # characters of a cell
_FORMULA = ("=", "+", "-", "@", "\uff1d", "\uff0b", "\uff0d", "\uff20")  # and their wide forms
_WITHIN = re.compile(r"([;|]\s*)(?=[" + "".join(re.escape(c) for c in _FORMULA) + "])")
_QUOTED = set(",;|\"\t\n\r'")  # the separators that spreadsheets guess at


def table_csv(columns: Sequence[Column]) -> str:
    """A header, then a row per recording. Numbers in full precision; what is missing is empty.

    Text that a spreadsheet would run as a formula gets an apostrophe in front; control characters
    are written as escapes.
    """
    lines = [",".join(write_text(column.name) for column in columns)]
    cells = [[write_cell(value) for value in column.values] for column in columns]
    lines += [",".join(row) for row in zip(*cells, strict=True)]
    return "\n".join(lines) + "\n"


def write_cell(value: Figure) -> str:
    """One value as a cell: `repr` of a number, `True` or `False`, or text."""
    if value is None:
        return ""
    return write_text(value) if isinstance(value, str) else repr(value)


def write_text(text: str) -> str:
    """Text as a cell."""
    safe = harmless(text)
    if _QUOTED & set(safe) or safe != safe.strip():
        return '"' + safe.replace('"', '""') + '"'
    return safe


def harmless(text: str) -> str:
    """`text` on one line, and no formula."""
    safe = printable(text, _LONGEST)
    # A spreadsheet may split at other separators than the comma.
    safe = _WITHIN.sub(r"\1'", safe)
    return f"'{safe}" if safe.lstrip().startswith(_FORMULA) else safe
