"""`bench.toml`: where the instruments are, and what they and the laser stand."""

import tomllib
from pathlib import Path
from typing import Literal

import pydantic
from pydantic import Field

from rapi_jax import DataError
from rapi_jax.io import printable
from rapi_jax.io._safe import StrPath, cause, located, read_text

from ._tables import Amplifier, DigitizerTable, Generator, Laser, Limits, Optics, Table


class BenchFile(Table):
    """The whole file."""

    schema_: Literal["rapi.bench/1"] = Field(alias="schema")
    limits: Limits
    generator: Generator
    amplifier: Amplifier = Amplifier()
    laser: Laser | None = None
    digitizer: DigitizerTable
    optics: Optics
    settling: int = Field(default=5, ge=1, le=10_000)  # periods played before a record


def read_bench(path: StrPath) -> BenchFile:
    """Read `bench.toml`. Raises `DataError`, in one line, that names the key and what is wrong.

    No limit has a default: what the device behind the generator stands, this package cannot know.
    """
    with located(printable(path)):
        try:
            table = tomllib.loads(read_text(Path(path)))
            found = BenchFile.model_validate(table)
            found.limits.of()
            if found.amplifier.gain == 0:
                raise DataError("`amplifier.gain` must not be zero.")
            return found
        except tomllib.TOMLDecodeError as error:
            raise DataError(f"not a TOML file ({cause(error)}).") from error
        except pydantic.ValidationError as error:
            first = error.errors()[0]
            where = ".".join(str(part) for part in first["loc"]) or "the file"
            raise DataError(f"`{printable(where, 60)}`: {printable(first['msg'], 120)}.") from error
        except ValueError as error:
            raise DataError(printable(error, 200)) from error
