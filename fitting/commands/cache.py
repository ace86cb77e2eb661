"""`rapi cache`: where compiled programs are kept, and how much they take."""

import json as encoder
import sys
from typing import Annotated

from cyclopts import Parameter


def cache(
    *,
    clear: Annotated[bool, Parameter(negative="")] = False,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Show where compiled programs are kept for the next command, how many, and their size.

    The folder is private: `RAPI_CACHE_DIR`, or `rapi-jax` in your cache folder. It can be removed
    at any time; programs are then compiled again. `--no-compile-cache` or `RAPI_COMPILE_CACHE=0`
    leaves it alone; where you set `JAX_COMPILATION_CACHE_DIR`, JAX keeps them there.

    Parameters
    ----------
    clear
        Remove them.
    json
        Print one JSON object on standard output.
    """
    from fitting.compile_cache import Entries, cache_state, clear_entries, count_entries

    state = cache_state()
    removed = clear_entries(state.root) if clear and state.root is not None else Entries(0, 0)
    kept = Entries(0, 0) if state.root is None else count_entries(state.root)
    if json:
        about = {
            "schema": "rapi.cache/1",
            "folder": None if state.root is None else str(state.root),
            "on": state.folder is not None,
            "reason": state.reason,
            "entries": kept.count,
            "bytes": kept.size,
            "removed": removed.count,
        }
        sys.stdout.write(encoder.dumps(about, indent=1, ensure_ascii=False) + "\n")
        return 0
    lines = [f"folder   {state.root or 'none'}", f"entries  {kept.count}, {kept.size / 1e6:.1f} MB"]
    if clear:
        lines.append(f"removed  {removed.count}, {removed.size / 1e6:.1f} MB")
    if state.folder is None:
        lines.append(f"off      {state.reason}")
    sys.stdout.writelines(f"{_printable(line)}\n" for line in lines)
    return 0


def _printable(line: str) -> str:
    """`line` with nothing in it that a terminal would obey."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
