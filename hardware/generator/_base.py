"""What a waveform generator is to a bench: one output that plays a period within limits."""

import abc
import math

from pydantic import Field

from hardware._driver import AbstractDriver, AbstractDriverTable
from rapi_jax import AfgWaveform, Drive, DriveLimits


class AbstractGeneratorTable(AbstractDriverTable):
    """The settings of every generator.

    - `channel`: the output. `load_ohm`: what is connected, `inf` for high impedance.
    - `park_v`: where the output rests before it is switched. `points`: samples a period.
    - `watchdog_s`: where given, the output ends each drive by itself, so much later than the record
      needs, s: what instruments may take to answer, and data to come over.
    """

    channel: int = Field(default=1, ge=1)
    load_ohm: float = Field(default=math.inf, gt=0)
    park_v: float = Field(default=0.0, allow_inf_nan=False)
    points: int = Field(default=131072, ge=2)
    watchdog_s: float | None = Field(default=None, ge=2.0, le=3600.0)


class AbstractOutput(abc.ABC):
    """One output: a period is loaded while it is off, played, parked and switched off.

    - `limits`: as asked for or narrower; the driver refuses whatever exceeds them.
    - `load_ohm`: the load that the instrument reckons with, as read back, ohm.
    """

    limits: DriveLimits
    load_ohm: float

    @abc.abstractmethod
    def load_drive(self, drive: Drive, *, points: int) -> AfgWaveform:
        """Load one period of `drive`, resampled to `points`; the waveform as it will be played.

        Raises `LimitError` or `DataError`, with nothing sent, for a drive that exceeds `limits`.
        """

    @abc.abstractmethod
    def start(self) -> None:
        """Check load and limits at the instrument, switch on at the park voltage, and play."""

    @abc.abstractmethod
    def off(self) -> None:
        """Return to the park voltage and switch off; where it is off already, nothing is sent.

        Raises `InstrumentError` that says so where the output may still be on.
        """


class AbstractWatchdog(abc.ABC):
    """An output that ends a drive by itself, also where its computer is killed or loses power.

    `most_cycles`: the periods that it can count.
    """

    most_cycles: int

    @abc.abstractmethod
    def set_watchdog(self, cycles: int | None) -> None:
        """Play `cycles` periods after each `start` and rest at the drive's first value.

        `None`: play until `off`. It holds for what is loaded next. Raises `ValueError` for more
        than `most_cycles`, and while the output is on.
        """

    @abc.abstractmethod
    def playing_s(self) -> float:
        """How much longer the drive certainly plays, s; infinite where nothing ends it."""


class AbstractGenerator(AbstractDriver):
    """A generator with a trigger output; at its end every output is parked and off.

    `Table` derives from `AbstractGeneratorTable`.
    """

    @abc.abstractmethod
    def set_trigger(self) -> None:
        """Play continuously, with a pulse at the trigger output at the start of each period."""

    @abc.abstractmethod
    def channel(
        self, number: int, *, limits: DriveLimits, load_ohm: float, park_v: float
    ) -> AbstractOutput:
        """The output of that number, off, with its load and its limits set and read back."""
