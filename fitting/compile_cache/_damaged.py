"""Entries that cannot be read: dropped without a word, and compiled and written again."""

import contextlib
import glob
import re
import warnings
from pathlib import Path
from typing import TextIO

from ._folder import is_machine_folder

UNREADABLE = "Error reading persistent compilation cache entry"
UNWRITABLE = "Error writing persistent compilation cache entry"
_PROGRAM = re.compile(re.escape(UNREADABLE) + r" for '(?P<name>[^']+)'")


def drop_damaged_entries(folder: Path) -> None:
    """Drop what JAX finds unreadable in `folder`, from now on and for the whole of this process.

    JAX does not write an entry in one step, so another process may read it half written, or find it
    so where the writer was killed. JAX then warns and compiles, but writes no entry where there is
    one. Here the warning is taken for what it says: all entries of a program of that name are
    dropped, before the one just compiled is written. A warning that an entry could not be written
    (a full disk, a folder that was removed) is dropped, too. In a folder that is not ours, by its
    name, nothing is done.
    """
    if not is_machine_folder(folder):
        return
    show = warnings.showwarning

    def show_others(
        message: Warning | str,
        category: type[Warning],
        filename: str,
        lineno: int,
        file: TextIO | None = None,
        line: str | None = None,
    ) -> None:
        text = str(message)
        if text.startswith(UNWRITABLE):
            return
        if not text.startswith(UNREADABLE):
            show(message, category, filename, lineno, file, line)
            return
        program = _PROGRAM.match(text)
        for path in folder.glob(f"{glob.escape(program['name'])}-*-cache") if program else ():
            with contextlib.suppress(OSError):
                path.unlink()

    for text in (UNREADABLE, UNWRITABLE):
        warnings.filterwarnings("always", re.escape(text), UserWarning)
    warnings.showwarning = show_others
