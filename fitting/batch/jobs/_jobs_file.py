"""Jobs listed in a TOML file, each with options of its own.

```toml
schema = "rapi.jobs/1"
do = "fit"                    # what `--do` says otherwise

[options]                     # of the single command, for all jobs
plays = 12

[[job]]
recording = "monday"          # relative to this file
name = "monday-cubic"         # of its folder; by default that of the recording

[[job]]
recording = "monday"
name = "monday-quartic"
options = { order = 4 }
```
"""

from pathlib import Path
from typing import Any, Literal

import pydantic

from rapi_jax import DataError
from rapi_jax.internal import check_name, located, read_toml
from rapi_jax.io import printable

SCHEMA = "rapi.jobs/1"
_LIMIT = 16 * 2**20  # bytes; a hundred thousand jobs


class _Strict(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)


class ListedJob(_Strict):
    """One `[[job]]`."""

    recording: str
    name: str | None = None
    options: dict[str, Any] = {}


class JobsFile(_Strict):
    """The whole file."""

    schema_: Literal["rapi.jobs/1"] = pydantic.Field(alias="schema")
    do: Literal["fit", "compensate", "diagnose", "range"] | None = None
    options: dict[str, Any] = {}
    job: list[ListedJob] = pydantic.Field(min_length=1)


def read_jobs_file(path: Path) -> JobsFile:
    """Read a list of jobs. Raises `DataError` with the key that is wrong."""
    label = printable(path)
    try:
        found = JobsFile.model_validate(read_toml(path, label, _LIMIT))
    except pydantic.ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise DataError(f"{label}: `{printable(where, 60)}`: {printable(first['msg'])}.") from error
    names = [job.name for job in found.job if job.name is not None]
    with located(label):
        for name in names:
            check_name(name)
            if names.count(name) > 1:
                raise DataError(f"two jobs are named '{name}'. Each has a folder of its own.")
    return found


def option_tokens(options: dict[str, Any]) -> list[str]:
    """Options of a file as they would stand on the command line. Raises `DataError`."""
    tokens = []
    for name, value in options.items():
        flag = f"--{name.replace('_', '-')}"
        if isinstance(value, bool):
            tokens.append(flag if value else f"--no-{name.replace('_', '-')}")
        elif isinstance(value, list) and all(isinstance(item, str) for item in value):
            tokens += [token for item in value for token in (flag, item)]
        elif isinstance(value, list):
            tokens += [flag, *(str(item) for item in value)]
        elif isinstance(value, str | int | float):
            tokens += [flag, str(value)]
        else:
            raise DataError(f"option `{printable(name)}` must be a number, a text or a list.")
    return tokens
