"""The tables of `bench.toml`."""

from typing import Annotated, Any, Literal

import pydantic
from pydantic import Field

from hardware.digitizer._base import Input
from hardware.digitizer._niscope import TRIGGER
from hardware.laser._limits import LaserLimits
from rapi_jax import DriveLimits

Range = tuple[float, float]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Address = Annotated[str, Field(min_length=1, max_length=200)]


class Table(pydantic.BaseModel):
    """A table of the file: no key is unknown, and a number is a number."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True)


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


class Generator(Table):
    """The AFG31052 and its channel; `load_ohm`: what is connected, `inf` for high impedance."""

    resource: Address
    backend: str = "@py"
    channel: Literal[1, 2] = 1
    load_ohm: float = Field(default=float("inf"), gt=0)
    park_v: float = Field(default=0.0, allow_inf_nan=False)
    points: int = Field(default=131072, ge=2, le=131072)


class Amplifier(Table):
    """Between generator and piezo: `gain` and `offset_v`."""

    gain: float = Field(default=1.0, allow_inf_nan=False)
    offset_v: float = Field(default=0.0, allow_inf_nan=False)


class LaserRanges(Table):
    """See `LaserLimits`."""

    wavelength_nm: Range
    piezo_percent: Range
    current_ma: Range
    diode_c: Range
    cavity_c: Range

    def of(self) -> LaserLimits:
        """As settings are checked against."""
        return LaserLimits(**self.model_dump())


class Laser(Table):
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


class InputRange(Table):
    """One input of the digitizer."""

    connector: int = Field(ge=0, le=64)
    low_v: float = Field(allow_inf_nan=False)
    high_v: float = Field(allow_inf_nan=False)

    def of(self) -> Input:
        """As the digitizer is told."""
        return Input(**self.model_dump())


class _Reading(Table):
    """What every digitizer reads.

    `margin_s`: recorded on either side of the drive; `latency_s`: from the trigger until the
    drive's first sample is at the piezo.
    """

    interferometer: InputRange
    cavity: InputRange | None = None
    sample_hz: Positive = 5e6
    margin_s: float = Field(default=9e-3, ge=0, allow_inf_nan=False)
    latency_s: float = Field(default=0.0, ge=0, allow_inf_nan=False)

    def inputs(self) -> dict[str, Input]:
        """By what they read."""
        inputs = {"interferometer": self.interferometer.of()}
        return inputs if self.cavity is None else inputs | {"cavity": self.cavity.of()}


class InfiniiVisionTable(_Reading):
    """A Keysight oscilloscope."""

    kind: Literal["infiniivision"] = "infiniivision"
    resource: Address
    backend: str = "@py"


class NiScopeTable(_Reading):
    """An NI digitizer; see `NiScope`."""

    kind: Literal["niscope"]
    resource: Address
    trigger: Address = TRIGGER
    level_v: float | None = Field(default=None, allow_inf_nan=False)


class ReplayTable(_Reading):
    """Raw records of an earlier measurement."""

    kind: Literal["replay"]
    folder: Address


def _kind(value: Any) -> str:
    kind = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
    return str(kind or "infiniivision")


DigitizerTable = Annotated[
    Annotated[InfiniiVisionTable, pydantic.Tag("infiniivision")]
    | Annotated[NiScopeTable, pydantic.Tag("niscope")]
    | Annotated[ReplayTable, pydantic.Tag("replay")],
    pydantic.Discriminator(_kind),
]


class Optics(Table):
    """`delay_s`: of the auxiliary interferometer; `fsr_ghz`: of the cavity."""

    delay_s: Positive
    fsr_ghz: Positive = 1.5
