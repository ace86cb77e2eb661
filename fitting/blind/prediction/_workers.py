"""Diagnoses in separate processes, each restricted by the blindfold from its first job on.

Processes are spawned, not forked: none holds what its parent has read. This module is imported
before the blindfold is installed, so it imports nothing heavy and nothing of the simulator.
"""

import contextlib
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass
from multiprocessing.process import BaseProcess
from pathlib import Path

from fitting._threads import ONE_THREAD
from fitting.compile_cache import DIRECTORY, drop_damaged_entries, worker_variables
from fitting.compile_cache._memory_maps import forget_programs


@dataclass(frozen=True)
class Job:
    """All that a diagnosis is told: where a recording is, what it may not name, where to write."""

    recording: str
    withheld: str | None
    output: str
    tree_sha256: str
    baselines: bool = True
    scan: bool = True

    @property
    def name(self) -> str:
        """The recording's."""
        return Path(self.recording).name


@dataclass(frozen=True)
class _Worker:
    """An executor of one process, so that a process that dies is known by its job."""

    executor: ProcessPoolExecutor
    process: BaseProcess


def default_workers() -> int:
    """Two, or one where there is one processor."""
    from ._thresholds import THRESHOLDS

    return min(THRESHOLDS.default_workers, os.cpu_count() or 1)


def predict_in_workers(
    jobs: Sequence[Job], answers: Path, workers: int, *, compiled: Path
) -> Generator[str, None, None]:
    """Run the jobs, and yield each one's name once its prediction is written.

    **Arguments:**

    - `answers`: the folder that is closed meanwhile, and that no process can read.
    - `workers`: how many processes.
    - `compiled`: folder of the compilation cache that the processes share, in later runs too:
      recordings of a bank have many shapes, and compiling for one takes as long as a diagnosis.
      Where this process has a cache, as the command line does, that one.

    Raises `DataError` where a recording cannot be read or a prediction not be written, and
    `RuntimeError` where a process ends before its job does; what is written stays.
    """
    waiting = deque(jobs)
    settings = ONE_THREAD | worker_variables(compiled)
    running: dict[Future[None], tuple[_Worker, Job]] = {}
    with hide_folder(answers), _ended() as started:
        for _ in range(min(workers, len(jobs))):
            job = waiting.popleft()
            with _environment(settings):  # read when the process loads NumPy and JAX
                worker, future = _start(answers, job)
            started.append(worker)
            running[future] = worker, job
        while running:
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                worker, job = running.pop(future)
                _raise_failure(future, worker, job)
                if waiting:
                    following = waiting.popleft()
                    running[worker.executor.submit(_run_job, following)] = worker, following
                yield job.name


@contextlib.contextmanager
def hide_folder(answers: Path) -> Iterator[None]:
    """Nobody but root can open the folder meanwhile; the blindfold restricts root too."""
    answers.chmod(0o000)
    try:
        yield
    finally:
        answers.chmod(0o700)


def _start(answers: Path, job: Job) -> tuple[_Worker, Future[None]]:
    executor = ProcessPoolExecutor(
        1, multiprocessing.get_context("spawn"), _initialise, (str(answers),)
    )
    before = set(multiprocessing.active_children())
    future = executor.submit(_run_job, job)  # starts the process
    (process,) = set(multiprocessing.active_children()) - before
    return _Worker(executor, process), future


def _raise_failure(future: Future[None], worker: _Worker, job: Job) -> None:
    from rapi_jax import DataError

    try:
        future.result()
    except (BrokenProcessPool, MemoryError) as error:
        worker.process.join()
        code = worker.process.exitcode
        end = "ran out of memory" if isinstance(error, MemoryError) else f"ended with code {code}"
        raise RuntimeError(
            f"the process that diagnosed {job.name} {end}. Run again with fewer --workers if "
            "memory was short."
        ) from None
    except (DataError, OSError) as error:
        raise DataError(f"{job.name}: {str(error) or type(error).__name__}") from None


@contextlib.contextmanager
def _environment(settings: Mapping[str, str]) -> Iterator[None]:
    """Environment variables, for the block alone."""
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextlib.contextmanager
def _ended() -> Iterator[list[_Worker]]:
    """End all processes that the block appends, at once where it is left by an exception."""
    started: list[_Worker] = []
    try:
        yield started
    except BaseException:
        for worker in started:
            worker.process.terminate()
        raise
    finally:
        for worker in started:
            worker.executor.shutdown(cancel_futures=True)


_refused: list[str] = []  # of a worker process: what its blindfold has refused so far


def _initialise(answers: str) -> None:
    """Prepare a worker process: the parent alone interrupts it, and the blindfold is installed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    drop_damaged_entries(Path(os.environ.get(DIRECTORY, "")))
    from ._blindfold import install

    global _refused
    _refused = install(Path(answers))


def _end_with_parent() -> None:
    """End this process where its parent was killed: nobody else would tell it."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _run_job(job: Job) -> None:
    from ._predict import predict_one

    predict_one(job, _refused)
    forget_programs()  # recordings of a bank have many shapes
