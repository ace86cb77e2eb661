"""A Dask worker as a process of this computer, started and ended by the batch.

`python -m fitting.batch.executors._local_worker`, with one line of JSON on its standard input. The
process ends when that is closed: by its parent, or with it. Dask's own nanny is not used: where a
worker ended in the moment in which it had registered, it started no other.
"""

import asyncio
import contextlib
import dataclasses
import json
import os
import subprocess
import sys
import threading
from typing import Any

from fitting._threads import ONE_THREAD
from fitting.batch.executors._worker import prepare_process

_TLS = (
    "tls_ca_file",
    "tls_client_cert",
    "tls_client_key",
    "tls_scheduler_cert",
    "tls_scheduler_key",
    "tls_worker_cert",
    "tls_worker_key",
)
# Dask samples the stack every 10 ms and keeps an hour of it: 0.7 MB/s with stacks as deep as ours.
NO_PROFILE = {"distributed.worker.profile.enabled": False}


@dataclasses.dataclass
class WorkerProcesses:
    """So many workers for the scheduler at `address`; those that end are started again."""

    address: str
    count: int
    security: Any
    folder: str  # of Dask's own files
    _running: list[subprocess.Popen[bytes]] = dataclasses.field(default_factory=list)

    def keep(self) -> None:
        """Start what is missing."""
        self._running = [process for process in self._running if process.poll() is None]
        while len(self._running) < self.count:
            self._running.append(self._start())

    def _start(self) -> subprocess.Popen[bytes]:
        process = subprocess.Popen(  # noqa: S603 (no shell, nothing of the user's)
            [sys.executable, "-m", __name__],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | ONE_THREAD,
            start_new_session=True,  # Ctrl-C is for the parent
        )
        about = {
            "address": self.address,
            "folder": self.folder,
            "path": sys.path,
            "security": {name: getattr(self.security, name) for name in _TLS},
        }
        if process.stdin is not None:
            with contextlib.suppress(BrokenPipeError):  # it ended at once, and is started again
                process.stdin.write(json.dumps(about).encode() + b"\n")
                process.stdin.flush()
        return process

    def end(self) -> None:
        """End all of them."""
        for process in self._running:
            process.kill()
        for process in self._running:
            process.wait()
            if process.stdin is not None:
                with contextlib.suppress(BrokenPipeError):
                    process.stdin.close()


def main() -> None:
    """Be a worker until the standard input ends."""
    about = json.loads(sys.stdin.readline())
    sys.path[:] = about["path"]
    threading.Thread(target=_end_with_input, daemon=True).start()
    prepare_process()
    asyncio.run(_serve(about))


def _end_with_input() -> None:
    while sys.stdin.buffer.read(4096):
        pass
    os._exit(1)


async def _serve(about: dict[str, Any]) -> None:
    import dask.config
    from distributed import Security, Worker

    dask.config.set(NO_PROFILE)
    security = Security(require_encryption=True, **about["security"])
    async with Worker(
        about["address"],
        nthreads=1,
        memory_limit=0,  # nothing of ours is spilled, and none waits: the system ends what is large
        local_directory=about["folder"],
        security=security,
    ) as worker:
        await worker.finished()


if __name__ == "__main__":
    main()
