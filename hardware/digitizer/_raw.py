"""Raw records in files: a column of codes an input as `.npy`, their scales as JSON.

`<name>.json` is written last and holds the hashes of the columns, so that a record is whole or not
there.
"""

import hashlib
import io
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pydantic
from pydantic import Field

from rapi_jax import DataError
from rapi_jax.internal import StrPath, cause, inside, located, open_regular, read_text
from rapi_jax.io import OutputError, printable, write_atomic

from ._base import Samples
from ._thresholds import THRESHOLDS

SCHEMA = "rapi.samples/1"


class _Column(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid")
    file: str = Field(max_length=200)
    sha256: str
    volts_per_code: float = Field(allow_inf_nan=False)
    zero_v: float = Field(allow_inf_nan=False)


class _Head(pydantic.BaseModel):
    model_config = pydantic.ConfigDict(extra="forbid")
    schema_: str = Field(alias="schema", pattern=f"^{SCHEMA}$")
    sample_hz: float = Field(gt=0, allow_inf_nan=False)
    start_s: float = Field(allow_inf_nan=False)
    full_scale: tuple[float, float] | None
    inputs: dict[str, _Column] = Field(min_length=1, max_length=64)
    notes: dict[str, str]


def write_samples(
    samples: Samples, folder: StrPath, name: str, *, notes: dict[str, str] | None = None
) -> Path:
    """Write a record under `name` into a folder that is there; the path of its JSON file.

    `notes`: what else belongs to it, as text. Raises `OutputError`.

    >>> import numpy as np
    >>> from hardware import Samples, write_samples
    >>> samples = Samples(
    ...     {"interferometer": np.zeros(100, np.int16)}, {"interferometer": 1e-3},
    ...     {"interferometer": 0.0}, sample_hz=5e6, start_s=0.0,
    ... )
    >>> write_samples(samples, ".", "record00").name
    'record00.json'
    """
    root = Path(folder)
    inputs: dict[str, Any] = {}
    for key, codes in samples.codes.items():
        column = io.BytesIO()
        np.lib.format.write_array(column, np.asarray(codes, dtype="<i2"), allow_pickle=False)
        file = f"{name}.{key}.npy"
        write_atomic(root / file, column.getbuffer())
        inputs[key] = {
            "file": file,
            "sha256": hashlib.sha256(column.getbuffer()).hexdigest(),
            "volts_per_code": float(samples.volts_per_code[key]),
            "zero_v": float(samples.zero_v[key]),
        }
    head = {
        "schema": SCHEMA,
        "sample_hz": samples.sample_hz,
        "start_s": samples.start_s,
        "full_scale": samples.full_scale,
        "inputs": inputs,
        "notes": notes or {},
    }
    path = root / f"{name}.json"
    write_atomic(path, json.dumps(head, indent=1) + "\n")
    return path


def check_raw_folder(folder: StrPath) -> None:
    """Refuse a folder that holds anything, before raw records are written into it: `OutputError`.

    A record among those of another measurement would be replayed with them.

    >>> import tempfile
    >>> from hardware import check_raw_folder
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     check_raw_folder(folder)  # empty: nothing is said
    """
    root, label = Path(folder), printable(folder)
    cure = "Choose a new folder, or move it away."
    try:
        first = min(root.iterdir(), default=None) if os.path.lexists(root) else None
    except OSError as error:
        raise OutputError(
            f"{label} is no folder for raw records: {cause(error)}. {cure}"
        ) from error
    if first is not None:
        raise OutputError(
            f"the folder {label} for raw records holds {printable(first.name, 80)} already, which "
            f"they would mix with or be written over. {cure}"
        )


def read_samples(path: StrPath) -> tuple[Samples, dict[str, str]]:
    """The record of a JSON file, and its notes. Raises `DataError` where it is not whole.

    >>> import numpy as np
    >>> from hardware import Samples, read_samples, write_samples
    >>> samples = Samples(
    ...     {"interferometer": np.zeros(100, np.int16)}, {"interferometer": 1e-3},
    ...     {"interferometer": 0.0}, sample_hz=5e6, start_s=0.0,
    ... )
    >>> path = write_samples(samples, ".", "record00", notes={"laser": "775 nm"})
    >>> again, notes = read_samples(path)
    >>> again.sample_hz, notes["laser"]
    (5000000.0, '775 nm')
    """
    path = Path(path)
    with located(printable(path)):
        try:
            head = _Head.model_validate_json(read_text(path, THRESHOLDS.head_bytes))
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"]) or "the file"
            raise DataError(
                f"no raw record (`{printable(where, 60)}`: {printable(first['msg'], 120)})."
            ) from error
        codes = {key: _column(path.parent, one) for key, one in head.inputs.items()}
        if len({column.size for column in codes.values()}) != 1:
            raise DataError("its columns differ in length. Copy the record again.")
    samples = Samples(
        codes=codes,
        volts_per_code={key: one.volts_per_code for key, one in head.inputs.items()},
        zero_v={key: one.zero_v for key, one in head.inputs.items()},
        sample_hz=head.sample_hz,
        start_s=head.start_s,
        full_scale=head.full_scale,
    )
    return samples, head.notes


def _column(folder: Path, about: _Column) -> np.ndarray:
    with open_regular(inside(folder, about.file), THRESHOLDS.column_bytes) as file:
        data = file.read()
    if hashlib.sha256(data).hexdigest() != about.sha256:
        raise DataError(f"{printable(about.file)} is not what was written. Copy it again.")
    file = io.BytesIO(data)
    try:
        version = np.lib.format.read_magic(file)
        shape, _, kind = np.lib.format.read_array_header_1_0(file)
        if kind.hasobject:
            raise ValueError("objects")
    except (ValueError, EOFError) as error:
        raise DataError(f"{printable(about.file)} is no column of numbers.") from error
    content = data[file.tell() :]
    # Before anything of the size that it claims is made.
    if version != (1, 0) or kind != np.dtype("<i2") or shape != (len(content) / 2,):
        raise DataError(f"{printable(about.file)} must be one column of 16-bit codes.")
    return np.frombuffer(content, "<i2").astype(np.int16)
