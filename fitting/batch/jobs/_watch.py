"""Recordings as they arrive in a folder: taken once each is complete."""

import time
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from fitting.batch._thresholds import THRESHOLDS
from fitting.batch.jobs._find import arrived
from fitting.batch.jobs._key import MANIFEST, named_files
from rapi_jax import DataError
from rapi_jax.internal import read_toml

State = tuple[tuple[str, int, int], ...]  # name, bytes, ns of each file


def watch(
    task: str, given: Sequence[str], clock: Callable[[], float] = time.monotonic
) -> Iterator[list[str]]:
    """The recordings that have become complete since the last time, without an end.

    A recording is complete once its manifest reads, all files that it names are there, and none has
    changed for `settle_s`. One that changes afterwards comes again.
    """
    seen: dict[str, tuple[State, float]] = {}
    taken: dict[str, State] = {}
    while True:
        began = clock()
        complete = []
        for path in arrived(task, given):
            state = state_of(Path(path))
            if state is None or taken.get(path) == state:
                continue
            before, since = seen.get(path, (None, began))
            if state != before:
                seen[path] = state, began
            elif began - since >= THRESHOLDS.settle_s:
                taken[path] = state
                complete.append(path)
        yield complete
        if not complete:
            time.sleep(max(0.0, THRESHOLDS.poll_s - (clock() - began)))


def state_of(path: Path) -> State | None:
    """Size and time of each file of a recording; `None` where it is not all there."""
    files = [path]
    try:
        if path.is_dir():
            if (path / MANIFEST).exists():
                read_toml(path / MANIFEST, MANIFEST)
            files = named_files(path)
        states = [(file.name, file.stat()) for file in files]
    except (DataError, ValueError, OSError):
        return None
    return tuple((name, about.st_size, about.st_mtime_ns) for name, about in states)
