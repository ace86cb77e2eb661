"""Tektronix AFG31052, basic mode: the instrument and its two channels."""

import contextlib
import math
from typing import Literal

from pydantic import Field

from hardware._driver import AbstractConnector, Address, Backend
from hardware.links._scpi import Scpi
from rapi_jax import DriveLimits

from . import _commands as commands
from ._base import AbstractGenerator, AbstractGeneratorTable
from ._channel import AfgChannel
from ._port import AfgPort
from ._states import State

_NO_TRIGGER = "No pulse would mark the start of each period."


class Afg31000Table(AbstractGeneratorTable):
    """The AFG31052 at a VISA resource."""

    resource: Address
    backend: Backend = "@py"
    channel: Literal[1, 2] = 1
    points: int = Field(default=131072, ge=2, le=131072)

    @property
    def resources(self) -> tuple[str, ...]:
        """Its address."""
        return (self.resource,)


class AFG31000(AbstractGenerator):
    """The generator, identified; its channels are had from `channel`.

    A context manager: at its end every output is ramped to its park voltage and off, and the
    connection is closed.

    >>> from hardware import AFG31000, DriveLimits, Scpi
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> from rapi_jax import triangle
    >>> limits = DriveLimits(0.0, 7.5, slew_v_per_s=2000.0, step_v=0.1, max_frequency_hz=100.0)
    >>> (drive,) = triangle([20.0], amplitude=4.5, bias=3.0)
    >>> with AFG31000(Scpi(SimulatedLink(SimulatedAFG31052()))) as generator:
    ...     generator.set_trigger()
    ...     output = generator.channel(1, limits=limits)
    ...     wave = output.load_drive(drive, points=4096)
    ...     output.start()
    ...     output.on
    True
    >>> output.on, wave.codes.size  # parked and off
    (False, 4096)
    """

    kind = "afg31000"
    Table = Afg31000Table
    supports_dry_run = True

    @classmethod
    def open(cls, table: Afg31000Table, connector: AbstractConnector) -> "AFG31000":
        """Connect and identify it."""
        return cls(Scpi(connector.connect(table.resource, backend=table.backend)))

    def __init__(self, scpi: Scpi) -> None:
        """Raises `InstrumentError` for any other instrument than an AFG31052."""
        self._scpi = scpi
        self._identity = scpi.identify(commands.IDENTITY)
        scpi.clear()
        self._channels: dict[int, AfgChannel] = {}
        self._trigger: dict[str, State] = {}  # as set, by header

    @property
    def identity(self) -> str:
        """Its `*IDN?`."""
        return self._identity

    def channel(
        self,
        number: int,
        *,
        limits: DriveLimits | None,
        load_ohm: float = math.inf,
        park_v: float = 0.0,
    ) -> AfgChannel:
        """Channel 1 or 2, off, with its load and its clamp set and read back.

        - `limits`: of the voltage at the load; required: `None` is refused.
        - `load_ohm`: what is connected, infinite for the high impedance of an amplifier's input.
        - `park_v`: where the output rests before it is switched; as near to it as `limits` allow.
          A relay that opens at another voltage than 0 is itself a step.
        """
        if number not in commands.CHANNELS:
            raise ValueError(f"Argument `number` must be 1 or 2, but is {number}.")
        if number in self._channels:
            raise ValueError(f"Channel {number} is in use already.")
        port = AfgPort(self._scpi, number)
        channel = AfgChannel(port, limits, load_ohm, park_v, self._trigger.values())
        self._channels[number] = channel
        try:
            channel.prepare()
        except BaseException:
            del self._channels[number]
            raise
        return channel

    def set_trigger(self, *, source: str = "TIM", output: str = "TRIG") -> None:
        """`source`: "TIM" (internal) or "EXT"; `output`: "TRIG" or "SYNC" at the connector."""
        for name, value, known in (
            ("source", source, ("TIM", "EXT")),
            ("output", output, ("TRIG", "SYNC")),
        ):
            if value not in known:
                raise ValueError(f"Argument `{name}` must be one of {known}, but is {value!r}.")
        for template, value in (
            (commands.TRIGGER_SOURCE, source),
            (commands.TRIGGER_OUTPUT, output),
        ):
            state = State(template, value, rf"(?i:{value}\w*)", _NO_TRIGGER)
            self._scpi.command(f"{template} {value}")
            self._scpi.text(template + "?", state.answer)
            self._trigger[template] = state

    def off(self) -> None:
        """Park and switch off every channel that may be on; all are tried."""
        with contextlib.ExitStack() as stack:
            for channel in self._channels.values():
                stack.callback(channel.off)

    def close(self) -> None:
        """Park, switch off and disconnect."""
        try:
            self.off()
        finally:
            self._scpi.close()
