"""A note of each job that is being computed, so that one that ends its process is known by it.

It stands in the batch's own folder, `DIR/.batch/`, from the beginning of a job to its end, beside a
lock that its process holds. A note without a process that holds its lock is of a process that ended
meanwhile: by the job, or by somebody who ended it.
"""

import contextlib
import dataclasses
import json
from collections.abc import Iterator
from pathlib import Path

from fitting.batch.jobs._job import Job

from ._thresholds import THRESHOLDS

NOTES = ".batch"


@dataclasses.dataclass(frozen=True)
class Attempt:
    """One try at a job.

    - `batch`: identifies the process that leads the batch.
    - `tries`: times the job was begun, this one included.
    - `shared`: whether it ran in the process that leads the batch, whose end nobody saw.
    """

    key: str
    batch: str
    tries: int
    shared: bool


def _note(output: Path, job: Job) -> Path:
    return output / NOTES / f"{job.name}.json"


def earlier_attempt(output: Path, job: Job) -> Attempt | None:
    """The try at this job that did not come to its end, if there was one."""
    try:
        content = json.loads(_note(output, job).read_text(encoding="utf-8"))
        found = Attempt(
            str(content["key"]), str(content["batch"]), int(content["tries"]), content["shared"]
        )
    except (OSError, ValueError, KeyError, TypeError):
        return None  # or cut short: then nothing had begun
    return found if found.key == job.key else None


@contextlib.contextmanager
def attempt(output: Path, job: Job, batch: str, *, shared: bool) -> Iterator[int]:
    """The number of this try, which is noted until the block ends, by an exception too.

    An earlier try counts where this batch, or the process that led it, saw its end: where the whole
    batch was ended, its workers were ended with it. Waits for a worker of an earlier batch that
    still computes the job. Raises `OSError` where no note can be written.
    """
    import filelock

    note = _note(output, job)
    lock = filelock.FileLock(note.with_suffix(".lock"), timeout=THRESHOLDS.lock_s)
    with lock:
        before = earlier_attempt(output, job)
        tries = 1 if before is None else before.tries
        if before is not None and (before.batch == batch or before.shared):
            tries += 1
        now = Attempt(job.key, batch, tries, shared)
        note.write_text(json.dumps(dataclasses.asdict(now)), encoding="utf-8")
        try:
            yield tries
        finally:
            with contextlib.suppress(OSError):
                note.unlink()
            with contextlib.suppress(OSError):
                note.with_suffix(".lock").unlink()
