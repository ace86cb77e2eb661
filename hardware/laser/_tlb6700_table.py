"""The table of a bench file for a TLB-6700."""

from typing import Annotated

import pydantic
from pydantic import Field

from hardware._driver import Address, Backend, Table

from . import _commands as commands
from ._base import AbstractLaserTable
from ._limits import LaserLimits

_Finite = Annotated[float, Field(allow_inf_nan=False)]
Listed = Annotated[tuple[_Finite, _Finite], Field(strict=False)]  # a list in TOML


Token = Annotated[pydantic.SecretStr, Field(min_length=16, max_length=200, strict=False)]


class LaserRanges(Table):
    """See `LaserLimits`."""

    wavelength_nm: Listed
    piezo_percent: Listed
    current_ma: Listed
    diode_c: Listed
    cavity_c: Listed

    def of(self) -> LaserLimits:
        """As settings are checked against."""
        return LaserLimits(**self.model_dump())


class Tlb6700Table(AbstractLaserTable):
    """The TLB-6700: behind a `resource` (a bridge), or with the vendor's library by `serial`."""

    resource: Address | None = None
    serial: Address | None = None
    backend: Backend = "@py"
    token: Token | None = None  # of a bridge that asks for one; shown in no recording
    limits: LaserRanges

    @pydantic.model_validator(mode="after")
    def _one_way(self) -> "Tlb6700Table":
        if (self.resource is None) == (self.serial is None):
            raise ValueError("give either `resource` or `serial`")
        if self.serial is not None:
            commands.serial_number(self.serial)
        return self

    @property
    def resources(self) -> tuple[str, ...]:
        """Its address or serial number."""
        return (self.resource or commands.serial_number(self.serial or ""),)
