"""A job, what computes it, and what comes of it."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from fitting.batch._record import Status


class BatchError(Exception):
    """A batch that cannot begin or go on, in one line; what is finished stays finished."""


@dataclasses.dataclass(frozen=True)
class Job:
    """One recording and what to do with it.

    - `name`: of its folder in the output folder.
    - `recording`: the path as given; `path` is the same, absolute.
    - `task`, `options`: what to compute.
    - `key`: SHA-256 of all that decides the result; see `job_key`. Empty until it is needed.
    - `redo`: compute it again where it failed before.
    """

    name: str
    recording: str
    path: Path
    task: str
    options: Mapping[str, Any]
    key: str = ""
    redo: bool = False


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What a job came to.

    - `written`: the files, all in the job's folder.
    - `lasting`: whether the same would come of it again. Where a file could not be written it would
      not, and nothing is kept of the job.
    - `stop`: why the jobs that follow would fail alike (a full disk); empty where they would not.
    """

    status: Status
    exit_code: int
    message: str = ""
    provenance: Mapping[str, str] = dataclasses.field(default_factory=dict)
    written: Sequence[Path] = ()
    lasting: bool = True
    stop: str = ""


Work = Callable[[Job, Path], Outcome]
"""Computes a job into the folder given. A function of a module, so that other processes find it; it
raises nothing but what ends the process."""
