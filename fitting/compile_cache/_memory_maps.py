"""Compiled programs in the memory of a long process, which are forgotten before they are too many.

Each holds some memory maps, of which Linux grants a process 65530; the next one then ends it. A
process that diagnoses recordings of many shapes got there after 84 of them. Recordings of one shape
never do.
"""

import contextlib
import sys
from pathlib import Path

OWN, SHARED = 10_000, 30_000  # memory maps: of a worker of ours; of a process that has others, too


def forget_programs(most: int = OWN) -> None:
    """Forget what this process has compiled where it holds more than `most` memory maps."""
    jax = sys.modules.get("jax")
    with contextlib.suppress(OSError):  # no Linux
        if jax is not None and count_maps() > most:
            jax.clear_caches()


def count_maps() -> int:
    """Memory maps of this process. Raises `OSError` where the system does not say."""
    return Path("/proc/self/maps").read_bytes().count(b"\n")
