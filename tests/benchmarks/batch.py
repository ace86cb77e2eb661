"""Batches ended by SIGKILL at random moments, then run to their end: what stands there.

    python3 -m uv run python -m tests.benchmarks.batch [--kills 200] [--jobs 12]
        [--part process worker scheduler ...] [--fits RECORDINGS]

- `process`: the process that leads a batch and does its jobs itself.
- `worker`: a random worker of a scheduler with two of them, while a batch uses it.
- `scheduler`: that scheduler; it is started again, and its workers come back to it.

After each kill the folder is read: a record must have the files it names, as they were written, and
no finished job may be begun again. Then the batch goes on, and is killed again, until its end; the
results must equal those of a batch that nobody ended, bit for bit but for seconds and times. The
jobs write two files of 64 kB; with `--fits` they are fits of the recordings in that folder.

Measured with fits of 4 x 400 samples, 12 jobs: 60 kills of the process, 15 of workers, 8 of the
scheduler: nothing torn, none done twice, all equal at the end.

A line a part; ends with 1 where once anything was torn, done twice, or different.
"""

import argparse
import collections
import contextlib
import dataclasses
import json
import multiprocessing
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

from fitting.batch._record import JOB, JobRecord
from fitting.batch._run import run_batch
from fitting.batch.jobs._find import find_recordings, name_jobs
from fitting.batch.jobs._job import BatchError, Job, Outcome
from rapi_jax.io import write_atomic

Counts = collections.Counter[str]
Jobs = Callable[[Path], list[Job]]


def write_two(job: Job, folder: Path) -> Outcome:
    """Two files, in some 30 ms; a line in a log for each time it is begun and ended."""
    _log(job, "begun")
    folder.mkdir(exist_ok=True)
    rng = random.Random(job.path.read_text())
    paths = [folder / "first.bin", folder / "second.bin"]
    for path in paths:
        write_atomic(path, rng.randbytes(65536))
        time.sleep(0.015)
    return Outcome("done", 0, "", {}, paths)


def fit_one(job: Job, folder: Path) -> Outcome:
    """A fit, as `rapi batch` does it."""
    from fitting.commands.shared._tasks import run_task

    _log(job, "begun")
    options = {name: value for name, value in job.options.items() if name != "log"}
    return run_task(dataclasses.replace(job, options=options), folder)


def _log(job: Job, what: str) -> None:
    with open(job.options["log"], "a") as log:
        log.write(f"{job.name} {what}\n")


@dataclasses.dataclass(frozen=True)
class World:
    """Jobs in a folder of their own, what computes them, and what they come to undisturbed."""

    folder: Path
    jobs: list[Job]
    work: Any
    whole: dict[str, Any]

    @property
    def start(self) -> Literal["fork", "spawn"]:
        """How a process that leads a batch is started; a fork may not use JAX."""
        return "fork" if self.work is write_two else "spawn"

    @property
    def seconds(self) -> float:
        """s that a few jobs take, within which something is killed."""
        return 0.3 if self.work is write_two else 5.0

    @property
    def log(self) -> Path:
        return self.folder / "log"

    def begun(self) -> Counts:
        """How often each job was begun."""
        text = self.log.read_text() if self.log.exists() else ""
        return collections.Counter(line.split()[0] for line in text.splitlines())

    def finished(self, output: Path) -> tuple[set[str], list[str]]:
        """The jobs finished there, and what is wrong with what stands there."""
        done, torn = set(), []
        for job in self.jobs:
            folder = output / job.name
            if (folder / JOB).exists():
                record = JobRecord.read(folder)  # raises where it is cut short
                if record.is_whole(folder):
                    done.add(job.name)
                else:
                    torn.append(job.name)
        return done, torn


def world(count: int, fits: Path | None, folder: Path) -> World:
    """`count` jobs, done once undisturbed."""
    log = folder / "log"
    if fits is None:
        work: Any = write_two
        jobs = []
        for number in range(count):
            (folder / f"in{number}").write_text(str(number))
            path = folder / f"in{number}"
            jobs.append(Job(f"j{number}", str(path), path, "fit", {"log": str(log)}))
    else:
        from fitting.commands.shared._tasks import complete_options

        work = fit_one
        paths = find_recordings("fit", [str(fits)])[:count]
        options = complete_options("fit", {"plots": False})
        jobs = [
            Job(name, path, Path(path).resolve(), "fit", options | {"log": str(log)})
            for path, name in zip(paths, name_jobs(paths), strict=True)
        ]
    (folder / "whole").mkdir()
    log.touch()
    for record in run_batch([jobs], folder / "whole", work):
        if record.status != "done":
            raise SystemExit(f"{record.name}, undisturbed: {record.message}")
    return World(folder, jobs, work, contents(folder / "whole"))


def contents(output: Path) -> dict[str, Any]:
    """All files of all jobs, but for what tells of the time."""
    found: dict[str, Any] = {}
    for path in sorted(output.glob("*/*")):
        if path.parent.name.startswith("."):
            continue
        key = str(path.relative_to(output))
        if path.suffix != ".json":
            found[key] = path.read_bytes()
            continue
        content = json.loads(path.read_text())
        for name in ("seconds", "started_at", "tries"):
            content.pop(name, None)
        files = content.get("files", {})
        content["files"] = {n: h for n, h in files.items() if not n.endswith(".json")}
        found[key] = content
    return found


Turn = Callable[[World, Path, random.Random], None]


def trial(here: World, kills: int, turn: Turn, rng: random.Random) -> Counts:
    """Kill until so many kills are spent, over as many batches as that takes."""
    counts: Counts = collections.Counter()
    while counts["kills"] < kills:
        output = Path(tempfile.mkdtemp(prefix="batch-", dir=here.folder))
        finished: set[str] = set()
        while counts["kills"] < kills and len(finished) < len(here.jobs):
            here.log.write_text("")
            turn(here, output, rng)
            counts["kills"] += 1
            again = finished & set(here.begun())
            counts["DONE TWICE"] += len(again)
            finished, torn = here.finished(output)
            counts["TORN"] += len(torn)
        here.log.write_text("")
        _lead(here, output, None)
        counts["DONE TWICE"] += len(finished & set(here.begun()))
        counts["batches"] += 1
        counts["DIFFERENT"] += contents(output) != here.whole
        shutil.rmtree(output)
    return counts


def _lead(here: World, output: Path, scheduler: str | None) -> None:
    with contextlib.suppress(BatchError):
        run_batch([here.jobs], output, here.work, scheduler=scheduler)


def kill_process(here: World, output: Path, rng: random.Random) -> None:
    """Kill a process that does jobs, some time after it began."""
    leader = multiprocessing.get_context(here.start).Process(
        target=_lead, args=(here, output, None)
    )
    leader.start()
    _wait_for_job(here, leader)
    time.sleep(rng.uniform(0.0, here.seconds))
    leader.kill()
    leader.join()


def _wait_for_job(here: World, leader: Any) -> None:
    """Wait until a job has begun: processes import for seconds before."""
    while leader.is_alive() and not here.begun():
        time.sleep(0.01)


@contextlib.contextmanager
def dask(folder: Path, workers: int = 2) -> Iterator[tuple[str, list[Any]]]:
    """A scheduler and workers as somebody starts them by hand: its address, and the processes."""
    port = random.SystemRandom().randrange(20000, 60000)
    address = f"tcp://127.0.0.1:{port}"
    processes = [start_scheduler(port)]
    environment = os.environ | {"NPROC": "1", "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "60s"}
    for _ in range(workers):
        command = [sys.executable, "-m", "distributed.cli.dask_worker", address]
        options = ["--nthreads", "1", "--no-dashboard", "--local-directory", str(folder)]
        processes.append(_quiet([*command, *options], environment))
    try:
        yield address, processes
    finally:
        for process in processes:
            process.kill()
            process.wait()


def start_scheduler(port: int) -> Any:
    """`dask scheduler` at a port of this computer."""
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--host", "127.0.0.1"]
    return _quiet([*command, "--port", str(port), "--no-dashboard"], dict(os.environ))


def _quiet(command: list[str], environment: dict[str, str]) -> Any:
    return subprocess.Popen(
        command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )


def with_dask(which: str) -> Callable[[World, int, random.Random], Counts]:
    """A part that kills a worker process, or the scheduler."""

    def part(here: World, kills: int, rng: random.Random) -> Counts:
        with dask(here.folder) as (address, processes):

            def turn(here: World, output: Path, rng: random.Random) -> None:
                leader = multiprocessing.get_context("spawn").Process(
                    target=_lead, args=(here, output, address)
                )
                leader.start()
                _wait_for_job(here, leader)
                time.sleep(rng.uniform(0.0, here.seconds))
                if which == "scheduler":
                    processes[0].kill()
                    processes[0].wait()
                    leader.join()
                    processes[0] = start_scheduler(int(address.rpartition(":")[2]))
                    return
                nanny = rng.choice(processes[1:])
                for child in _children(nanny.pid):
                    with contextlib.suppress(ProcessLookupError):
                        os.kill(child, signal.SIGKILL)
                leader.join()

            return trial(here, kills, turn, rng)

    return part


def _children(process: int) -> list[int]:
    import psutil

    found = psutil.Process(process).children(recursive=True)
    return [one.pid for one in found if "resource_tracker" not in " ".join(one.cmdline())]


PARTS: dict[str, Callable[[World, int, random.Random], Counts]] = {
    "process": lambda here, kills, rng: trial(here, kills, kill_process, rng),
    "worker": with_dask("worker"),
    "scheduler": with_dask("scheduler"),
}


def main() -> int:
    """Print it."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=12)
    parser.add_argument("--part", nargs="+", choices=PARTS, default=[*PARTS])
    parser.add_argument("--fits", type=Path)
    options = parser.parse_args()
    failed = False
    for name in options.part:
        folder = Path(tempfile.mkdtemp(prefix="batches-"))
        try:
            here = world(options.jobs, options.fits, folder)
            began = time.monotonic()
            counts = PARTS[name](here, options.kills, random.Random(0))
        finally:
            shutil.rmtree(folder, ignore_errors=True)
        wrong = {key: n for key, n in counts.items() if key.isupper() and n}
        failed |= bool(wrong)
        verdict = ", ".join(f"{key} {n}" for key, n in wrong.items()) or "nothing torn, none twice"
        seconds = time.monotonic() - began
        line = f"{counts['kills']} kills over {counts['batches']} batches of {len(here.jobs)} jobs"
        print(f"{name:10} {line}: {verdict}; {seconds:.0f} s", flush=True)
    return int(failed)


if __name__ == "__main__":
    sys.exit(main())
