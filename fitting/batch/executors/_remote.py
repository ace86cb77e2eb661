"""What a Dask worker is asked to run."""

from pathlib import Path
from typing import Any

from fitting.batch._do import Ended, do_job
from fitting.batch.jobs._job import BatchError, Job, Work
from fitting.batch.jobs._key import code_sha256


def do_remotely(job: Job, output: Path, work: Work, batch: str, code: str) -> Ended:
    """Do a job of a batch whose code is `code`.

    Raises `BatchError` where this worker, which may have joined later, has other code.
    """
    if code_sha256() != code:
        raise BatchError(
            "a worker that joined has another version of this package. Install the same there."
        )
    return do_job(job, output, work, batch, shared=False)


def describe_worker(token: str) -> dict[str, Any]:
    """The version of a worker, and whether it sees the file `token`."""
    return {"code_sha256": code_sha256(), "sees_token": Path(token).is_file()}
