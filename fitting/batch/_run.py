"""A batch: jobs not yet finished are handed to an executor, and what ends is told and tabulated."""

import contextlib
import math
import secrets
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

from fitting.batch.executors._cluster import at_scheduler, local_cluster
from fitting.batch.executors._executor import AbstractExecutor
from fitting.batch.executors._in_process import InProcess
from fitting.batch.jobs._job import BatchError, Job, Work
from fitting.batch.jobs._key import with_key
from rapi_jax.internal import cause, install_extra
from rapi_jax.io import OutputError, printable

from ._do import finished
from ._record import JOB, JobRecord
from ._thresholds import THRESHOLDS
from ._tries import NOTES

Tabulate = Callable[[Sequence[JobRecord], Path], object]
Report = Callable[[JobRecord, bool], object]
"""Called with the record of each job, and whether it was finished before."""


def run_batch(
    jobs: Iterable[list[Job]],
    output: Path,
    work: Work,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    tabulate: Tabulate = lambda records, folder: None,
    report: Report = lambda record, earlier: None,
    on_jobs: Callable[[int], object] = lambda count: None,
) -> list[JobRecord]:
    """Do the jobs that are not finished, each into `output / job.name`, and record each.

    A job is finished where its `job.json` has its key and all its files are as written. Whatever
    ends this process, the next batch into that folder goes on where it was.

    **Arguments:**

    - `jobs`: lists of jobs; all there are in one, or for a watched folder what has arrived since
      the last (nothing, mostly), without an end.
    - `workers`: of a cluster on this computer; 0 for this process.
    - `scheduler`: address of a Dask scheduler to use in its place.
    - `tabulate`: called with the records so far, in the order of the jobs: now and then, and at the
      end, by an interrupt too.
    - `report`: called for each job that ended; `on_jobs`: with the number of jobs to do, for each
      list.

    **Returns** the records, in the order of the jobs. Raises `BatchError` where another batch
    writes into that folder or workers cannot be used, and `OutputError` where nothing more can be
    written.
    """
    batch = secrets.token_hex(8)
    with lock_output(output):
        (output / NOTES).mkdir(exist_ok=True)
        with _executor(output, work, batch, workers, scheduler) as executor:
            leader = _Leader(executor, output, tabulate, report)
            try:
                for some in jobs:
                    on_jobs(leader.take(some))
                    leader.step()
                while not leader.idle:
                    leader.step()
            except BaseException:
                with contextlib.suppress(Exception):  # the first one tells more
                    leader.write_table()
                raise
            leader.write_table()
            return leader.records


class _Leader:
    """Hands out jobs and keeps their records."""

    def __init__(
        self, executor: AbstractExecutor, output: Path, tabulate: Tabulate, report: Report
    ) -> None:
        self._executor, self._output = executor, output
        self._tabulate, self._report = tabulate, report
        self._order: dict[str, JobRecord | None] = {}  # by name
        self._waiting: deque[Job] = deque()
        self._written, self._pause = time.monotonic(), THRESHOLDS.table_s
        self._changed = False

    @property
    def records(self) -> list[JobRecord]:
        """Of the jobs that ended, in the order in which they came."""
        return [record for record in self._order.values() if record is not None]

    @property
    def idle(self) -> bool:
        return not (self._waiting or self._executor.running)

    def take(self, jobs: list[Job]) -> int:
        """Take jobs, and return how many of them are to be done."""
        before = len(self._waiting)
        for job in jobs:
            done = None
            if (self._output / job.name / JOB).exists():  # else the key is needed later
                job = with_key(job)
                done = finished(job, self._output)
            self._order[job.name] = done
            if done is None:
                self._waiting.append(job)
            else:
                self._changed = True
                self._report(done, True)
        return len(self._waiting) - before

    def step(self) -> None:
        """Hand out what is free, take what ended, and tabulate where that is due.

        Raises `OutputError` where all that follows would fail.
        """
        while self._waiting and self._executor.free > 0:
            self._executor.submit(with_key(self._waiting.popleft()))
        for ended in [] if self.idle else self._executor.wait(THRESHOLDS.poll_s):
            self._order[ended.record.name] = ended.record
            self._changed = True
            self._report(ended.record, False)
            if ended.stop:
                raise OutputError(ended.stop)
        # Where nothing else is to be done, a writing that takes long keeps nothing waiting.
        pause = THRESHOLDS.table_s if self.idle else self._pause
        if self._changed and time.monotonic() > self._written + pause:
            try:
                self.write_table()
            except Exception:  # no job fails for it; that at the end says what is wrong
                self._written, self._pause = time.monotonic(), math.inf

    def write_table(self) -> None:
        """Tabulate the records there are."""
        began = time.monotonic()
        self._tabulate(self.records, self._output)
        now = time.monotonic()
        self._pause = max(THRESHOLDS.table_s, (now - began) / THRESHOLDS.table_share)
        self._written, self._changed = now, False


@contextlib.contextmanager
def lock_output(output: Path) -> Iterator[None]:
    """Let no other batch write into the folder. Raises `BatchError` where one does."""
    try:
        import filelock
    except ImportError as error:
        raise BatchError(
            f"a batch needs a package that is not installed here ({cause(error)}). "
            + install_extra("batch")
        ) from error
    try:
        (output / NOTES).mkdir(exist_ok=True)
        lock = filelock.FileLock(output / NOTES / "batch.lock", timeout=0)
        lock.acquire()
    except filelock.Timeout as error:
        raise BatchError(
            f"another batch writes into {printable(output)}. Wait until it ends, or choose another "
            "folder with `-o`."
        ) from error
    except OSError as error:
        raise OutputError(f"cannot write to {printable(output)}: {cause(error)}.") from error
    try:
        yield
    finally:
        lock.release()


def _executor(
    output: Path, work: Work, batch: str, workers: int, scheduler: str | None
) -> contextlib.AbstractContextManager[AbstractExecutor]:
    if scheduler is not None:
        return at_scheduler(scheduler, output, work, batch)
    if workers > 0:
        return local_cluster(workers, output, work, batch)
    return contextlib.nullcontext(InProcess(output, work, batch))
