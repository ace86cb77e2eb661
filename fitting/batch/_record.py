"""What is kept of a job: `job.json`, written last into the job's folder."""

import dataclasses
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, ClassVar, Literal, get_args

from fitting._json import json_text
from fitting._result_files import hash_files
from rapi_jax import DataError
from rapi_jax.internal import read_text
from rapi_jax.io import printable, write_atomic

JOB, SCHEMA = "job.json", "rapi.job/1"
Status = Literal["done", "failed", "skipped"]
_LIMIT = 2**20  # bytes of such a file; a job of a hundred drives takes 30 kB


@dataclasses.dataclass(frozen=True)
class JobRecord:
    """How one job of a batch ended.

    - `name`: of the job's folder in the output folder.
    - `recording`: the path that the job was given, as it was given.
    - `task`: "fit", "compensate", "diagnose" or "range".
    - `key`: SHA-256 of task, options, data and code; equal keys give equal results.
    - `status`: "done" also where the result is not to be trusted (`exit_code` 4); "failed" where
      there is no result; "skipped" where the task has nothing to do with what it was given (drives
      from a model that is not to be trusted, `exit_code` 4).
    - `exit_code`: what the single command would have ended with; 1 where its process was ended.
    - `message`: one line on what is wrong; empty where nothing is.
    - `seconds`: of the last try.
    - `tries`: how often the job was begun, 2 or 3 where its process was ended meanwhile.
    - `started_at`: when the last try began, ISO 8601 in UTC.
    - `provenance`: of the recording, where it could be read.
    - `files`: SHA-256 of each file that the job wrote, by its name in the job's folder.
    """

    schema: ClassVar[str] = SCHEMA
    name: str
    recording: str
    task: str
    key: str
    status: Status
    exit_code: int
    message: str
    seconds: float
    tries: int
    started_at: str
    provenance: Mapping[str, str] = dataclasses.field(default_factory=dict)
    files: Mapping[str, str] = dataclasses.field(default_factory=dict)

    def to_dict(self) -> dict[str, Any]:
        """As in the file."""
        return {"schema": SCHEMA} | dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> "JobRecord":
        """From `to_dict`. Raises `ValueError` where a field is missing or of another kind."""
        if content.get("schema") != SCHEMA:
            raise ValueError(f"the schema is {content.get('schema')!r}, not {SCHEMA!r}")
        values: dict[str, Any] = {}
        for field in dataclasses.fields(cls):
            kind = _KINDS[field.name]
            value: Any = content.get(field.name)
            if kind is float and type(value) is int:
                value = float(value)
            if type(value) is not kind:
                raise ValueError(f"`{field.name}` is missing or of another kind")
            if kind is dict and not all(type(text) is str for text in value.values()):
                raise ValueError(f"`{field.name}` holds what is not text")
            values[field.name] = value
        if values["status"] not in get_args(Status):
            raise ValueError(f"`status` is {values['status']!r}")
        return cls(**values)

    def write(self, folder: Path) -> None:
        """Write `job.json` into the job's folder. Raises `OutputError`."""
        write_atomic(folder / JOB, json_text(self.to_dict()))

    @classmethod
    def read(cls, folder: Path) -> "JobRecord":
        """Read `job.json` of a job's folder. Raises `DataError` where there is none that reads."""
        path = folder / JOB
        try:
            return cls.from_dict(json.loads(read_text(path, _LIMIT)))
        except (ValueError, AttributeError, RecursionError) as error:
            raise DataError(
                f"{printable(path)}: not a record of a job, or damaged ({printable(error)}). Run "
                "the batch again."
            ) from error

    def is_whole(self, folder: Path) -> bool:
        """Whether every file that the job wrote is in `folder` as it was written."""
        try:
            found = hash_files(folder / name for name in self.files)
        except OSError:
            return False
        return found == dict(self.files)


_KINDS: dict[str, type] = {
    "name": str, "recording": str, "task": str, "key": str, "status": str, "exit_code": int,
    "message": str, "seconds": float, "tries": int, "started_at": str, "provenance": dict,
    "files": dict,
}  # fmt: skip
