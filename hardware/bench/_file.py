"""`bench.toml`: where the instruments are, and what they and the laser stand."""

import tomllib
from pathlib import Path
from typing import Annotated, Literal

import pydantic
from pydantic import Field

from rapi_jax import DataError, DriveLimits
from rapi_jax.io import printable
from rapi_jax.io._safe import StrPath, cause, located, read_text

from ..digitizer._base import Input
from ..laser._limits import LaserLimits

Range = tuple[float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Address = Annotated[str, Field(min_length=1, max_length=200)]


class _Table(pydantic.BaseModel):
    """A table of the file: no key is unknown, and a number is a number."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)


class Limits(_Table):
    """Of the voltage at the piezo's input; every one of them must be given."""

    low_v: float = Field(allow_inf_nan=False)
    high_v: float = Field(allow_inf_nan=False)
    slew_v_per_s: Positive
    step_v: Positive
    max_frequency_hz: Positive

    def of(self) -> DriveLimits:
        """As the drive is checked against."""
        return DriveLimits(**self.model_dump())


class Generator(_Table):
    """The AFG31052 and its channel; `load_ohm`: what is connected, `inf` for high impedance."""

    resource: Address
    backend: str = "@py"
    channel: Literal[1, 2] = 1
    load_ohm: float = Field(default=float("inf"), gt=0)
    park_v: float = Field(default=0.0, allow_inf_nan=False)
    points: int = Field(default=131072, ge=2, le=131072)


class Amplifier(_Table):
    """Between generator and piezo: `gain` and `offset_v`."""

    gain: float = Field(default=1.0, allow_inf_nan=False)
    offset_v: float = Field(default=0.0, allow_inf_nan=False)


class LaserRanges(_Table):
    """See `LaserLimits`."""

    wavelength_nm: Range
    piezo_percent: Range
    current_ma: Range
    diode_c: Range
    cavity_c: Range

    def of(self) -> LaserLimits:
        """As settings are checked against."""
        return LaserLimits(**self.model_dump())


class Laser(_Table):
    """The TLB-6700: behind a `resource` (a bridge), or with the vendor's library by `serial`."""

    resource: Address | None = None
    serial: Address | None = None
    backend: str = "@py"
    limits: LaserRanges

    @pydantic.model_validator(mode="after")
    def _one_way(self) -> "Laser":
        if (self.resource is None) == (self.serial is None):
            raise ValueError("give either `resource` or `serial`")
        return self


class InputRange(_Table):
    """One input of the digitizer."""

    connector: int = Field(ge=0, le=64)
    low_v: float = Field(allow_inf_nan=False)
    high_v: float = Field(allow_inf_nan=False)

    def of(self) -> Input:
        """As the digitizer is told."""
        return Input(**self.model_dump())


class DigitizerTable(_Table):
    """An InfiniiVision oscilloscope; `margin_s`: recorded on either side of the drive."""

    kind: Literal["infiniivision"] = "infiniivision"
    resource: Address
    backend: str = "@py"
    interferometer: InputRange
    cavity: InputRange | None = None
    sample_hz: Positive = 5e6
    margin_s: float = Field(default=9e-3, ge=0, allow_inf_nan=False)


class Optics(_Table):
    """`delay_s`: of the auxiliary interferometer; `fsr_ghz`: of the cavity."""

    delay_s: Positive
    fsr_ghz: Positive = 1.5


class BenchFile(_Table):
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
