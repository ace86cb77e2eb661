"""One job, in the process that calls: computed, and recorded last."""

import dataclasses
import datetime
import time
from pathlib import Path

from fitting._result_files import hash_files
from fitting.batch.jobs._job import Job, Outcome, Work
from fitting.compile_cache._memory_maps import forget_programs
from rapi_jax import DataError
from rapi_jax.io import OutputError

from ._record import JobRecord
from ._thresholds import THRESHOLDS
from ._tries import attempt

PROCESS_ENDED = 1  # exit code of a job whose process was ended


@dataclasses.dataclass(frozen=True)
class Ended:
    """How a job ended.

    - `kept`: whether `job.json` says so.
    - `stop`: why the jobs that follow would fail alike, if they would.
    """

    record: JobRecord
    kept: bool = True
    stop: str = ""


def finished(job: Job, output: Path) -> JobRecord | None:
    """The record of a job that is not to be done again: of its key, with all files as written."""
    folder = output / job.name
    try:
        record = JobRecord.read(folder)
    except DataError:
        return None
    if record.key != job.key or (job.redo and record.status == "failed"):
        return None
    if not record.is_whole(folder):
        return None
    # The same data may have been given by another path.
    return dataclasses.replace(record, recording=job.recording)


def do_job(job: Job, output: Path, work: Work, batch: str, *, shared: bool) -> Ended:
    """Compute the job into its folder, and write its record.

    A job that another process finished meanwhile is not computed, and one that was begun too often
    is given up. `batch`, `shared`: see `Attempt`.
    """
    started, began = datetime.datetime.now(datetime.UTC), time.perf_counter()
    tries = 1
    try:
        with attempt(output, job, batch, shared=shared) as tries:
            done = finished(job, output)
            if done is not None:
                return Ended(done)
            if tries > THRESHOLDS.tries:
                outcome, tries = gave_up(), THRESHOLDS.tries
            else:
                outcome = work(job, output / job.name)
            record = _record(job, outcome, tries, started, time.perf_counter() - began)
            if outcome.lasting:
                (output / job.name).mkdir(exist_ok=True)
                record.write(output / job.name)
            return Ended(record, kept=outcome.lasting, stop=outcome.stop)
    except OSError as error:  # the note or the record: the output folder itself
        line = str(error) if isinstance(error, OutputError) else f"{output}: {error.strerror}"
        outcome = Outcome("failed", 3, line, lasting=False)
        seconds = time.perf_counter() - began
        return Ended(_record(job, outcome, tries, started, seconds), kept=False, stop=line)
    finally:
        forget_programs()


def give_up(job: Job, output: Path, tries: int) -> Ended:
    """Record a job that ended its process in every try."""
    record = _record(job, gave_up(), tries, datetime.datetime.now(datetime.UTC), 0.0)
    try:
        (output / job.name).mkdir(exist_ok=True)
        record.write(output / job.name)
    except OSError as error:
        return Ended(record, kept=False, stop=str(error))
    return Ended(record)


def gave_up() -> Outcome:
    """Of a job that ended its process in every try."""
    return Outcome(
        "failed",
        PROCESS_ENDED,
        f"its process was ended {THRESHOLDS.tries} times (a crash, or memory ran short): run it "
        "alone to see why, or again with --retry",
    )


def _record(
    job: Job, outcome: Outcome, tries: int, started: datetime.datetime, seconds: float
) -> JobRecord:
    return JobRecord(
        name=job.name,
        recording=job.recording,
        task=job.task,
        key=job.key,
        status=outcome.status,
        exit_code=outcome.exit_code,
        message=outcome.message,
        seconds=round(seconds, 6),
        tries=tries,
        started_at=started.isoformat(timespec="milliseconds"),
        provenance=dict(outcome.provenance),
        files={name: digest or "" for name, digest in hash_files(outcome.written).items()},
    )
