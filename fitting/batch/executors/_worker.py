"""How a Dask worker is prepared. Imports nothing heavy: it comes before the first import of JAX."""

import os
import sys
from pathlib import Path
from typing import Any

from fitting._threads import ONE_THREAD
from fitting.compile_cache import DIRECTORY, cache_root, drop_damaged_entries, worker_variables


def prepare_process() -> None:
    """Compute on one thread, with the compile cache that all processes of the user share.

    JAX reads both when it is imported, so nothing is done where it is.
    """
    if "jax" in sys.modules:
        return
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
    root = cache_root()
    if root is not None:
        os.environ.update(worker_variables(root))
    drop_damaged_entries(Path(os.environ.get(DIRECTORY, "")))


def preparation() -> Any:
    """A plugin that prepares each worker of a cluster, those that join later too."""
    from distributed import WorkerPlugin

    class Preparation(WorkerPlugin):
        name = "rapi-batch"
        idempotent = True

        def setup(self, worker: Any) -> None:
            del worker
            prepare_process()

    return Preparation()
