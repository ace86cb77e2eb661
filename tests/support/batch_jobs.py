"""Jobs of a batch that compute next to nothing, for tests of the batch itself."""

import os
import signal
import time
from pathlib import Path

from fitting.batch.jobs._job import Job, Outcome


def jobs_in(folder: Path, names: str) -> list[Job]:
    """A job for each letter; its recording is a file that holds what to do."""
    return [Job(name, str(folder / name), folder / name, "fit", {}) for name in names]


def copy(job: Job, folder: Path) -> Outcome:
    """Do what the recording says: write a result, fail, or end this process."""
    text = job.path.read_text()
    with open(job.path.with_suffix(".log"), "a") as log:  # one line a try
        log.write(f"{os.getpid()}\n")
    if text == "exit":
        os._exit(3)
    if text == "kill":
        os.kill(os.getpid(), signal.SIGKILL)
    if text == "bad":
        return Outcome("failed", 3, "bad data: it says so")
    if text == "untrusted":
        return Outcome("done", 4, "not to be trusted: it says so")
    if text.startswith("slow"):
        time.sleep(0.3)
    folder.mkdir(exist_ok=True)
    (folder / "result.txt").write_text(text)
    return Outcome("done", 0, "", {"text": text}, [folder / "result.txt"])
