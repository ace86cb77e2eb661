"""What a driver must declare to be named in `bench.toml`: a kind, a table of settings, `open`."""

import abc
from typing import Annotated, Any, ClassVar, Literal

import pydantic
from pydantic import Field

from ._closes import ClosesOnExit
from .links._link import AbstractLink

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Address = Annotated[str, Field(min_length=1, max_length=200)]
# VISA: pyvisa-py, or the library that is installed on the computer (NI-VISA, Keysight's). A file
# never names a library by its path: what is loaded from there would run.
Backend = Literal["@py", "@ivi"]


class Table(pydantic.BaseModel):
    """A table of the file: no key is unknown, and a number is a number."""

    model_config = pydantic.ConfigDict(extra="forbid", frozen=True, strict=True)


class AbstractDriverTable(Table, abc.ABC):
    """The table of one instrument. `kind`: its driver's, filled in where the file leaves it out."""

    kind: str

    @property
    @abc.abstractmethod
    def resources(self) -> tuple[str, ...]:
        """Addresses that no other program may use while the bench is open; empty for none."""


class AbstractConnector(abc.ABC):
    """Gives a driver its connections: real ones, or in a dry run those of simulated instruments.

    `dry_run`: whether nothing may be reached but by `connect`.
    """

    dry_run: bool

    @abc.abstractmethod
    def connect(self, resource: str, *, backend: str = "") -> AbstractLink:
        """A connection to a VISA resource. Raises `InstrumentError`.

        `backend`: as `VisaLink` takes it.
        """


class AbstractDriver(ClosesOnExit):
    """An instrument that is identified when it is opened; a context manager.

    - `kind`: its name in `bench.toml`, as in `kind = "infiniivision"`.
    - `Table`: what that table of the file may hold, checked before anything is connected.
    - `supports_dry_run`: whether `open` reaches nothing where its connector is one of a dry run.
      Other drivers are refused in a dry run.
    """

    kind: ClassVar[str]
    Table: ClassVar[type[AbstractDriverTable]]
    supports_dry_run: ClassVar[bool] = False

    @classmethod
    @abc.abstractmethod
    def open(cls, table: Any, connector: AbstractConnector) -> "AbstractDriver":
        """Connect and identify the instrument of `table`, an instance of `Table`.

        Nothing is switched on. Raises `InstrumentError`, also for another instrument.
        """

    @property
    @abc.abstractmethod
    def identity(self) -> str:
        """What the instrument says it is."""


class AbstractReadBack(abc.ABC):
    """An instrument, or an output of one, whose settings a bench compares about each record.

    A driver that derives from this too promises that no setting changes unseen during a record.
    `resource`: its address.
    """

    resource: str

    @abc.abstractmethod
    def settings(self) -> dict[str, str]:
        """Each setting that a record depends on, by its name, as the instrument tells it now.

        Nothing sensed, such as a temperature. Raises `InstrumentError`.
        """
