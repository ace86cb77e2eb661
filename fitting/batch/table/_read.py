"""What a job's folder says: estimates, figures and verdict, each JSON file read once."""

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from fitting._result_files import UNFINISHED
from fitting.batch._record import JobRecord
from rapi_jax import DataError
from rapi_jax.internal import cause, inside, open_regular

from ._figures import Row, read_certificate, read_diagnosis, read_model, read_range

_LIMIT = 64 * 2**20  # bytes of a file; a diagnosis with all its maps takes 0.4 MB
# The list of a result, how its figures are read, and its schema.
_READERS: dict[str, tuple[Callable[[dict[str, Any]], Row], str]] = {
    "model.json": (read_model, "rapi.model/1"),
    "diagnosis.json": (read_diagnosis, "rapi.diagnosis/1"),
    "certificate.json": (read_certificate, "rapi.compensation/1"),
    "range.json": (read_range, "rapi.range/1"),
}


@dataclasses.dataclass(frozen=True)
class Result:
    """One recording of a batch: its job, and what its files say.

    `problem`: why what the job wrote cannot be read; empty where it can.
    """

    record: JobRecord
    row: Row
    problem: str = ""

    @property
    def message(self) -> str:
        """The one line on what is wrong."""
        return "; ".join(filter(None, [self.record.message, self.problem]))

    @property
    def trusted(self) -> bool | None:
        """Whether the fit is to be trusted; None where there is none."""
        found = self.row.figures.get("trusted")
        return found if isinstance(found, bool) else None

    @property
    def done(self) -> bool:
        """Whether there is a result that can be read."""
        return self.record.status == "done" and not self.problem


def read_result(record: JobRecord, folder: Path) -> Result:
    """What the job of `record` wrote into its folder of the batch's `folder`.

    Files that are missing, damaged or of another job than `record` says leave their figures out.
    """
    row, problems = Row(), []
    for name, (read, schema) in _READERS.items():
        if name not in record.files:
            continue
        try:
            found = read(_load(record, folder, name, schema))
        except DataError as error:
            problems.append(str(error))
        except (TypeError, ValueError, AttributeError, KeyError, RecursionError) as error:
            problems.append(f"{name} is not as `rapi` writes it ({cause(error)})")
        else:
            row = row | found
    return Result(record, row | _provenance(record.provenance), "; ".join(problems))


def _load(record: JobRecord, folder: Path, name: str, expected: str) -> dict[str, Any]:
    """The object in one file. Raises `DataError` where it is not the one the job wrote."""
    with open_regular(inside(folder, record.name) / name, _LIMIT) as file:
        data = file.read(_LIMIT)
    if hashlib.sha256(data).hexdigest() != record.files[name]:
        raise DataError(f"{name} is not the file that the job wrote: run the batch again")
    content = json.loads(data)
    schema = content.get("schema")
    if schema != expected:
        why = "is not finished" if schema == UNFINISHED else "has another schema"
        raise DataError(f"{name} {why}: run the batch again")
    return content


def _provenance(provenance: Mapping[str, str]) -> Row:
    """Time and temperature of the recording, where it names them."""
    figures: dict[str, Any] = {"recorded_at": provenance.get("recorded_at") or None}
    try:
        temperature = float(provenance["temperature_c"])
    except (KeyError, ValueError):
        temperature = math.nan
    figures["temperature_c"] = temperature if math.isfinite(temperature) else None
    return Row(figures=figures)
