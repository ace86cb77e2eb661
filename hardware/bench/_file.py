"""`bench.toml`: where the instruments are, and the limits of what they drive."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, Literal

import pydantic
from pydantic import Field, SerializeAsAny

from hardware._driver import Positive, Table
from hardware.digitizer._base import AbstractDigitizerTable
from hardware.generator._base import AbstractGeneratorTable
from hardware.laser._base import AbstractLaserTable
from rapi_jax import DataError, DriveLimits
from rapi_jax.internal import SPEED_OF_LIGHT, StrPath, located, read_toml
from rapi_jax.io import printable
from rapi_jax.ranging import AirState

from ._drivers import Driver, collect_drivers, validate_table
from ._mistakes import describe_mistake


class Limits(Table):
    """Of the voltage at the piezo's input; every one of them must be given."""

    low_v: float = Field(allow_inf_nan=False)
    high_v: float = Field(allow_inf_nan=False)
    slew_v_per_s: Positive
    step_v: Positive
    max_frequency_hz: Positive

    def of(self) -> DriveLimits:
        """As the drive is checked against."""
        return DriveLimits(**self.model_dump())


class Amplifier(Table):
    """Between generator and piezo: `gain` and `offset_v`."""

    gain: float = Field(default=1.0, allow_inf_nan=False)
    offset_v: float = Field(default=0.0, allow_inf_nan=False)


class Optics(Table):
    """What the light goes through.

    `delay_s`: of the auxiliary interferometer; `fsr_ghz`: of the cavity; `wavelength_m`: of the
    laser in vacuum; `rises_with_voltage`: whether the optical frequency does, for fringe records
    (`rapi bench range`). In a recording it always rises: fringes do not tell the sign.
    """

    delay_s: Positive
    fsr_ghz: Positive = 1.5
    wavelength_m: Positive = 780e-9
    rises_with_voltage: bool = True

    @property
    def interferometer_path_m(self) -> float:
        """Optical path difference of the auxiliary interferometer, m."""
        return SPEED_OF_LIGHT * self.delay_s


class Air(Table):
    """Of the measurement arm: `temperature_c`, `pressure_pa`, `relative_humidity` (0 to 1)."""

    temperature_c: float
    pressure_pa: float
    relative_humidity: float
    co2_ppm: float = 450.0

    def of(self) -> AirState:
        """As records say it. Raises `DataError` for what is no air of a laboratory."""
        return AirState(**self.model_dump())


class BenchFile(Table):
    """The whole file; the tables of instruments are those of the drivers that they name.

    >>> from pathlib import Path
    >>> from hardware import read_bench
    >>> from hardware.simulated import bench_toml
    >>> at = {"generator": "GEN", "laser": "LAS", "digitizer": "DIG"}  # VISA addresses
    >>> _ = Path("bench.toml").write_text(bench_toml(at, delay_s=24.5e-9))
    >>> read_bench("bench.toml").limits.high_v  # V
    7.5
    """

    schema_: Literal["rapi.bench/1"] = Field(alias="schema")
    limits: Limits
    generator: SerializeAsAny[AbstractGeneratorTable]
    amplifier: Amplifier = Amplifier()
    laser: SerializeAsAny[AbstractLaserTable] | None = None
    digitizer: SerializeAsAny[AbstractDigitizerTable]
    optics: Optics
    air: Air | None = None
    settling: int = Field(default=5, ge=1, le=10_000)  # periods played before a record

    @pydantic.field_validator("generator", "laser", "digitizer", mode="before")
    @classmethod
    def _of_driver(cls, value: Any, info: Any) -> Any:  # a ValidationInfo, no runtime protocol
        if value is None or info.context is None or info.field_name is None:
            return value
        return validate_table(info.context["drivers"], info.field_name, value)


def read_bench(path: StrPath, *, drivers: Iterable[Driver] = ()) -> BenchFile:
    """Read `bench.toml`. Raises `DataError`, in one line, that names the key and what is wrong.

    Of a key that is misspelt it also names the one that is likely meant.

    No limit has a default: this package cannot know what the device behind the generator
    withstands. `drivers`: classes beside those of this package that the file may name by their
    `kind`.

    >>> from pathlib import Path
    >>> from hardware import read_bench
    >>> from hardware.simulated import bench_toml
    >>> at = {"generator": "GEN", "laser": "LAS", "digitizer": "DIG"}  # VISA addresses
    >>> _ = Path("bench.toml").write_text(bench_toml(at, delay_s=24.5e-9))
    >>> file = read_bench("bench.toml")
    >>> file.generator.kind, file.digitizer.kind
    ('afg31000', 'infiniivision')
    """
    known = collect_drivers(drivers)
    label = printable(path)
    table = read_toml(Path(path), label)
    with located(label):
        try:
            found = BenchFile.model_validate(table, context={"drivers": known})
            found.limits.of()
            if found.air is not None:
                found.air.of()
            if found.amplifier.gain == 0:
                raise DataError("`amplifier.gain` must not be zero.")
            return found
        except pydantic.ValidationError as error:
            raise DataError(describe_mistake(error, table, BenchFile, known)) from error
        except ValueError as error:
            raise DataError(printable(error, 200)) from error
