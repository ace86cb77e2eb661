"""What a driver must declare to be named in `bench.toml`: a kind, a table of settings, `open`."""

import abc
from typing import Annotated, Any, ClassVar, Literal

import pydantic
from pydantic import Field

from ._closes import ClosesOnExit
from .links._link import AbstractLink

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
Address = Annotated[str, Field(min_length=1, max_length=200)]
Backend = Literal["@py", "@ivi"]
"""VISA: pyvisa-py ("@py"), or the library installed on the computer ("@ivi": NI-VISA, Keysight's).

A file never names a library by its path: what is loaded from there would run.
"""


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

    >>> from hardware import AFG31000, AbstractConnector
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> class Simulation(AbstractConnector):
    ...     dry_run = True
    ...
    ...     def connect(self, resource, *, backend=""):
    ...         return SimulatedLink(SimulatedAFG31052(), resource=resource)
    >>> generator = AFG31000.open(AFG31000.Table(kind="afg31000", resource="GEN"), Simulation())
    >>> generator.identity.split(",")[1]
    'AFG31052'
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

    >>> from hardware import AFG31000, AbstractDriver
    >>> issubclass(AFG31000, AbstractDriver), AFG31000.kind, AFG31000.supports_dry_run
    (True, 'afg31000', True)
    >>> AFG31000.Table(kind="afg31000", resource="TCPIP::192.168.0.7::INSTR").resources
    ('TCPIP::192.168.0.7::INSTR',)
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

    >>> from hardware import AbstractReadBack, InfiniiVision, Scpi
    >>> from hardware.simulated import SimulatedInfiniiVision, SimulatedLink
    >>> dark = SimulatedInfiniiVision(lambda now_s, first_s, count, sample_hz: None)
    >>> scope = InfiniiVision(Scpi(SimulatedLink(dark)))
    >>> isinstance(scope, AbstractReadBack), scope.resource
    (True, 'SIM::INSTR')
    """

    resource: str

    @abc.abstractmethod
    def settings(self) -> dict[str, str]:
        """Each setting that a record depends on, by its name, as the instrument tells it now.

        Nothing sensed, such as a temperature. Raises `InstrumentError`.
        """
