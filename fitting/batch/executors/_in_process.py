"""Jobs one after the other in this process; one that may have ended it before, in one apart."""

import multiprocessing
import os
import signal
import threading
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

from fitting.batch._do import Ended, do_job, give_up
from fitting.batch._thresholds import THRESHOLDS
from fitting.batch._tries import earlier_attempt
from fitting.batch.executors._executor import AbstractExecutor
from fitting.batch.jobs._job import Job, Work
from fitting.compile_cache import DIRECTORY, drop_damaged_entries


class InProcess(AbstractExecutor):
    """An executor of one job at a time."""

    def __init__(self, output: Path, work: Work, batch: str) -> None:
        self._output, self._work, self._batch = output, work, batch
        self._waiting: deque[Job] = deque()

    @property
    def running(self) -> int:
        return len(self._waiting)

    @property
    def free(self) -> int:
        return 1 - len(self._waiting)

    def submit(self, job: Job) -> None:
        self._waiting.append(job)

    def wait(self, timeout: float) -> list[Ended]:
        """Do what was submitted; `timeout` is for executors that wait for others."""
        del timeout
        ended = []
        while self._waiting:
            job = self._waiting.popleft()
            suspect = earlier_attempt(self._output, job) is not None
            do = self._apart if suspect else self._here
            ended.append(do(job))
        return ended

    def _here(self, job: Job) -> Ended:
        return do_job(job, self._output, self._work, self._batch, shared=True)

    def _apart(self, job: Job) -> Ended:
        """In a process of its own, again where it ends that, up to the number of tries."""
        for _ in range(THRESHOLDS.tries):
            context = multiprocessing.get_context("spawn")
            with ProcessPoolExecutor(1, context, _initialise) as executor:
                arguments = job, self._output, self._work, self._batch
                try:
                    return executor.submit(_do_apart, *arguments).result()
                except BrokenProcessPool:
                    last = earlier_attempt(self._output, job)
                    if last is not None and last.tries >= THRESHOLDS.tries:
                        break
        return give_up(job, self._output, THRESHOLDS.tries)


def _do_apart(job: Job, output: Path, work: Work, batch: str) -> Ended:
    return do_job(job, output, work, batch, shared=False)


def _initialise() -> None:
    """Prepare the process: its parent alone interrupts it, and ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    drop_damaged_entries(Path(os.environ.get(DIRECTORY, "")))


def _end_with_parent() -> None:
    """End this process where its parent was killed: nobody else would tell it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
