"""Diagnoses in processes of their own, each under the blindfold from its first task on.

Processes are spawned, not forked: none holds what its parent has read. This module loads before the
blindfold is on, so it imports nothing heavy and nothing of the worlds.
"""

import contextlib
import multiprocessing
import os
import signal
import sys
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, cast

_ONE_THREAD = ("MKL_NUM_THREADS", "OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
COMPILED = "compiled"  # folder of a bank
_PATIENCE_S = 10.0  # compiling cannot be interrupted


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


def usual_workers() -> int:
    """Two, or one where there is one processor."""
    return min(2, os.cpu_count() or 1)


def predict_in_workers(
    jobs: Sequence[Job], answers: Path, workers: int
) -> Generator[str, None, None]:
    """Do the jobs, and give each one's name once its prediction is written.

    Raises `DataError` where a recording cannot be read or a prediction not be written, and
    `RuntimeError` where a process ends before its work does; what is written stays.
    """
    from rapi_jax import DataError

    left = list(reversed(jobs))
    busy: dict[Any, tuple[BaseProcess, Job]] = {}  # by the line to each process

    def give(process: BaseProcess, line: Any) -> None:
        busy[line] = process, left.pop()
        line.send(busy[line][1])

    with hidden(answers), _stopped() as started:
        for _ in range(min(workers, len(jobs))):
            process, line = _begun(answers)
            started.append((process, line))
            give(process, line)
        while busy:
            for line in cast(list[Any], wait(list(busy))):
                process, job = busy.pop(line)
                try:
                    trouble = line.recv()
                except (EOFError, ConnectionResetError):
                    process.join(_PATIENCE_S)
                    raise RuntimeError(
                        f"the process that diagnosed {job.name} ended with code "
                        f"{process.exitcode}. Run again with fewer --workers if memory was short."
                    ) from None
                if trouble:
                    raise DataError(f"{job.name}: {trouble}")
                if left:
                    give(process, line)
                yield job.name


@contextlib.contextmanager
def hidden(answers: Path) -> Iterator[None]:
    """Nobody but root can open the folder meanwhile; the blindfold holds for root too."""
    answers.chmod(0o000)
    try:
        yield
    finally:
        answers.chmod(0o700)


def _begun(answers: Path) -> tuple[BaseProcess, Any]:
    """A process and the line to it.

    What one compiles, others take from the bank's folder, in later runs too: recordings of a bank
    have many shapes, and compiling for one takes as long as a diagnosis.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe()
    settings = dict.fromkeys(_ONE_THREAD, "1") | {
        "JAX_COMPILATION_CACHE_DIR": str(answers.parent / COMPILED),
        "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
    }
    process = context.Process(target=serve, args=(theirs, str(answers)), daemon=True)
    before = {name: os.environ.get(name) for name in settings}
    try:
        os.environ.update(settings)  # read when the child loads NumPy and JAX
        process.start()
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
    theirs.close()
    return process, ours


@contextlib.contextmanager
def _stopped() -> Iterator[list[tuple[BaseProcess, Any]]]:
    """End all that was started, however the block ends."""
    started: list[tuple[BaseProcess, Any]] = []
    try:
        yield started
    finally:
        for process, line in started:
            line.close()  # an idle one ends by itself
            process.terminate()
        for process, _ in started:
            process.join(_PATIENCE_S)
            if process.is_alive():
                process.kill()
                process.join()


def serve(line: Any, answers: str) -> None:
    """Work off jobs until nobody is at the other end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent says when to stop
    signal.signal(signal.SIGTERM, lambda number, frame: sys.exit(128 + number))
    from ._blindfold import put_on

    refused = put_on(Path(answers))
    while True:
        try:
            job = line.recv()
            line.send(_done(job, refused))
        except (EOFError, OSError):  # nobody listens any more
            signal.signal(signal.SIGTERM, signal.SIG_IGN)  # ending is under way
            return


def _done(job: Job, refused: Sequence[str]) -> str:
    """Do a job; what went wrong, or nothing."""
    from rapi_jax import DataError

    from ._predict import predict_one

    try:
        predict_one(job, refused)
    except (DataError, OSError) as error:
        return str(error) or type(error).__name__
    return ""
