"""Jobs in Dask workers: those of a cluster started here, or those of a scheduler that runs already.

Workers are processes of their own, never forked: a fork of a process that has used JAX hangs.
"""

import contextlib
import logging
import math
import queue
import secrets
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from fitting.batch._do import Ended, finished, give_up
from fitting.batch._thresholds import THRESHOLDS
from fitting.batch._tries import NOTES
from fitting.batch.executors._executor import AbstractExecutor
from fitting.batch.executors._local_worker import NO_PROFILE, WorkerProcesses
from fitting.batch.executors._remote import describe_worker, do_remotely
from fitting.batch.executors._worker import preparation
from fitting.batch.jobs._job import BatchError, Job, Work
from fitting.batch.jobs._key import code_sha256
from rapi_jax.internal import cause, install_extra
from rapi_jax.io import printable

_LOCAL = {
    # A task is given up after so many workers that it ended; its own count of tries comes first.
    "distributed.scheduler.allowed-failures": THRESHOLDS.tries,
    **NO_PROFILE,
    "logging": {"distributed": "critical"},
}


class Cluster(AbstractExecutor):
    """An executor on Dask workers; made by `local_cluster` or `at_scheduler`.

    `processes`: the workers, where they are ours to start again.
    """

    def __init__(
        self,
        client: Any,
        output: Path,
        work: Work,
        batch: str,
        processes: WorkerProcesses | None = None,
    ) -> None:
        self._client, self._output, self._work, self._batch = client, output, work, batch
        self._processes, self._last_seen = processes, time.monotonic()
        self._ended: queue.SimpleQueue[Any] = queue.SimpleQueue()
        self._jobs: dict[Any, Job] = {}
        self._killed: Counter[str] = Counter()
        self._threads, self._counted = 1, -math.inf

    def cancel(self) -> None:
        """Let no job begin any more; those that have begun go on to their end."""
        for future in self._jobs:
            with contextlib.suppress(Exception):
                future.cancel(force=True)

    @property
    def running(self) -> int:
        return len(self._jobs)

    @property
    def free(self) -> int:
        """Some for each thread; see `BatchThresholds.backlog`."""
        self._look()
        return max(1, self._threads) * THRESHOLDS.backlog - len(self._jobs)

    @property
    def _workerless_s(self) -> float:
        return time.monotonic() - self._last_seen

    def _look(self) -> None:
        """See now and then how many threads there are, and that workers of ours run."""
        now = time.monotonic()
        if now - self._counted > THRESHOLDS.poll_s:
            if self._processes is not None:
                self._processes.keep()
            self._threads, self._counted = sum(self._client.nthreads().values()), now
            if self._threads:
                self._last_seen = now

    def submit(self, job: Job) -> None:
        future = self._client.submit(
            do_remotely, job, self._output, self._work, self._batch, code_sha256(),
            key=f"{job.name}-{secrets.token_hex(8)}", pure=False,
        )  # fmt: skip
        self._jobs[future] = job
        future.add_done_callback(self._ended.put)

    def wait(self, timeout: float) -> list[Ended]:
        self._look()
        found = []
        with contextlib.suppress(queue.Empty):
            found.append(self._ended.get(timeout=timeout))
            while True:
                found.append(self._ended.get_nowait())
        if self._client.status != "running":
            raise BatchError(
                "the scheduler does not answer any more. What is finished stays finished: start it "
                "again, and run the same command again to go on."
            )
        if self._processes is not None and self._workerless_s > THRESHOLDS.start_s:
            raise BatchError(
                f"no worker has started for {THRESHOLDS.start_s:g} s. Run the same command again "
                "to go on, with fewer --workers if memory is short."
            )
        return [ended for future in found if (ended := self._collect(future)) is not None]

    def _collect(self, future: Any) -> Ended | None:
        """How the job of a future ended; `None` where it is begun again."""
        from distributed import KilledWorker
        from distributed.client import FutureCancelledError

        job = self._jobs.pop(future)
        if future.status == "finished" and (done := finished(job, self._output)) is not None:
            return Ended(done)  # from the folder: its worker may have ended since
        try:
            return future.result(timeout=THRESHOLDS.connect_s)
        except KilledWorker:
            self._killed[job.name] += 1
            if self._killed[job.name] >= THRESHOLDS.tries:
                return give_up(job, self._output, THRESHOLDS.tries)
        except (FutureCancelledError, TimeoutError):
            pass  # lost with its worker or its scheduler
        except BatchError:
            raise
        except Exception as error:
            raise BatchError(f"a worker cannot run {job.name}: {cause(error)}.") from error
        self.submit(job)
        return None


@contextlib.contextmanager
def local_cluster(workers: int, output: Path, work: Work, batch: str) -> Iterator[Cluster]:
    """An executor on so many processes of this computer, a thread each."""
    dask, distributed = _import_dask()
    # Whoever reaches a worker runs code in it, so other users of this computer must not.
    security = distributed.Security.temporary()
    with contextlib.ExitStack() as stack:
        stack.enter_context(dask.config.set(_LOCAL))
        cluster = distributed.LocalCluster(
            n_workers=0,
            host="127.0.0.1",
            dashboard_address="127.0.0.1:0",
            silence_logs=logging.CRITICAL,
            security=security,
        )
        stack.enter_context(cluster)
        client = stack.enter_context(distributed.Client(cluster, set_as_default=False))
        folder = stack.enter_context(tempfile.TemporaryDirectory(ignore_cleanup_errors=True))
        processes = WorkerProcesses(cluster.scheduler_address, workers, security, folder)
        stack.callback(processes.end)
        yield Cluster(client, output, work, batch, processes)


@contextlib.contextmanager
def at_scheduler(address: str, output: Path, work: Work, batch: str) -> Iterator[Cluster]:
    """An executor on the workers of the scheduler at `address`.

    They must see the output folder by the same path, and have the same version of these packages.
    Raises `BatchError` where they do not, or where nobody answers.
    """
    _, distributed = _import_dask()
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        client = distributed.Client(address, timeout=THRESHOLDS.connect_s, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise BatchError(
            f"no scheduler answers at {printable(address)} ({cause(error)}). Start one with "
            "`dask scheduler`, and give the address it prints."
        ) from error
    with client:
        client.register_plugin(preparation())
        _check_workers(client, address, output)
        executor = Cluster(client, output, work, batch)
        try:
            yield executor
        finally:
            executor.cancel()


def _check_workers(client: Any, address: str, output: Path) -> None:
    try:
        client.wait_for_workers(1, timeout=THRESHOLDS.connect_s)
    except TimeoutError as error:
        raise BatchError(
            f"the scheduler at {printable(address)} has no workers. Start some with `dask worker "
            f"{printable(address)} --nthreads 1`."
        ) from error
    token = output / NOTES / f"{secrets.token_hex(8)}.token"
    token.write_text("", encoding="utf-8")
    try:
        found = client.run(describe_worker, str(token), on_error="return")
    finally:
        token.unlink()
    for worker, about in found.items():
        if isinstance(about, BaseException):
            raise BatchError(
                f"the worker at {worker} cannot run jobs ({cause(about)}). Install this package "
                "where it runs."
            )
        if about["code_sha256"] != code_sha256():
            raise BatchError(
                f"the worker at {worker} has another version of this package or of those it "
                "rests on. Install the same there, and start it again."
            )
        if not about["sees_token"]:
            raise BatchError(
                f"the worker at {worker} does not see the output folder {printable(output)}. "
                "Recordings and results must be on a file system that all share, by one path."
            )


def _import_dask() -> tuple[Any, Any]:
    logging.getLogger("asyncio").setLevel(logging.CRITICAL)  # of what was asked of a lost worker
    try:
        import dask
        import distributed
    except ImportError as error:
        raise BatchError(
            f"workers need a package that is not installed here ({cause(error)}). "
            + install_extra("batch")
        ) from error
    return dask, distributed
