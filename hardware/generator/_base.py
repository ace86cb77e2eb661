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
    - `watchdog_s`: if given, the output ends each drive by itself this long after the record should
      have ended, s; allow for slow answers and data transfer.

    >>> from hardware import AbstractGeneratorTable
    >>> class OwnTable(AbstractGeneratorTable):
    ...     address: str
    ...
    ...     @property
    ...     def resources(self):
    ...         return (self.address,)
    >>> table = OwnTable(kind="own", address="GPIB0::11::INSTR", park_v=1.0)
    >>> table.points, table.resources
    (131072, ('GPIB0::11::INSTR',))
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

    >>> from hardware import AFG31000, AbstractOutput, DriveLimits, Scpi
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> limits = DriveLimits(0.0, 4.5, slew_v_per_s=2000.0, step_v=0.1, max_frequency_hz=100.0)
    >>> with AFG31000(Scpi(SimulatedLink(SimulatedAFG31052()))) as generator:
    ...     output: AbstractOutput = generator.channel(1, limits=limits, load_ohm=50.0)
    ...     output.load_ohm, output.limits.high_v <= 4.5
    (50.0, True)
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

    >>> from hardware import AFG31000, AbstractWatchdog, DriveLimits, Scpi
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> from rapi_jax import triangle
    >>> limits = DriveLimits(0.0, 7.5, slew_v_per_s=2000.0, step_v=0.1, max_frequency_hz=100.0)
    >>> (drive,) = triangle([20.0], amplitude=4.5, bias=3.0)
    >>> with AFG31000(Scpi(SimulatedLink(SimulatedAFG31052()))) as generator:
    ...     output = generator.channel(1, limits=limits)
    ...     assert isinstance(output, AbstractWatchdog)
    ...     output.set_watchdog(40)
    ...     _ = output.load_drive(drive, points=4096)
    ...     output.start()
    ...     output.playing_s() <= 2.0  # 40 periods of 50 ms
    True
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

    >>> from hardware import AFG31000, AbstractGenerator, Scpi
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> generator: AbstractGenerator = AFG31000(Scpi(SimulatedLink(SimulatedAFG31052())))
    >>> generator.set_trigger()
    >>> generator.kind, generator.identity.split(",")[1]
    ('afg31000', 'AFG31052')
    >>> generator.close()
    """

    @abc.abstractmethod
    def set_trigger(self) -> None:
        """Play continuously, with a pulse at the trigger output at the start of each period."""

    @abc.abstractmethod
    def channel(
        self, number: int, *, limits: DriveLimits, load_ohm: float, park_v: float
    ) -> AbstractOutput:
        """The output of that number, off, with its load and its limits set and read back."""
