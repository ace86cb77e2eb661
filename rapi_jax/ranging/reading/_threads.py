"""Work on parts of a record side by side: NumPy and SciPy let go of the interpreter's lock."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

In = TypeVar("In")
Out = TypeVar("Out")


def workers() -> int:
    """Processors that this process may use, eight at most."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return max(1, min(count or 1, 8))


def side_by_side(work: Callable[[In], Out], parts: Iterable[In]) -> list[Out]:
    """`work` of every part, in order, on as many threads as there are processors."""
    several = list(parts)
    if len(several) < 2 or workers() < 2:
        return [work(part) for part in several]
    with ThreadPoolExecutor(min(workers(), len(several))) as pool:
        return list(pool.map(work, several))
