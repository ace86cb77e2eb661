"""Files of a folder replaced by new ones, where its manifest changes over from these to those."""

import contextlib
import json
from collections.abc import Iterable, Iterator
from pathlib import Path

from ._atomic import sync, sync_folder
from ._leftovers import remove_leftovers, temporary_name
from ._unfinished import SUFFIX, named_files, remove_unnamed, update_list


@contextlib.contextmanager
def replacing(folder: Path, table: str, fresh: Iterable[str]) -> Iterator[None]:
    """Of what the manifest names in `table` and of `fresh`, only what is named in the end stays.

    The block writes the files `fresh`, then the manifest. Where an exception ends it, the files
    before are still named, and `fresh` is removed; where a kill does, the next write into the
    folder removes what is not named.
    """
    remove_leftovers(folder)
    files = update_list(folder, fresh=fresh, before=named_files(folder, table) or set())
    path = folder / temporary_name(SUFFIX)
    try:
        path.write_text(json.dumps(files), encoding="utf-8")
        sync(path)
        sync_folder(folder)
        yield
    finally:
        if remove_unnamed(folder, files):
            with contextlib.suppress(OSError):
                path.unlink()
