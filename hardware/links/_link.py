"""The interface of a connection to an instrument: bytes out and in, each with a deadline."""

import abc
from typing import NamedTuple


class Received(NamedTuple):
    """Some bytes; `end`: whether the transport says that the message ends with them."""

    data: bytes
    end: bool


class AbstractLink(abc.ABC):
    r"""A connection to one instrument, with its own clock (real, or that of a simulation).

    A deadline is a time on that clock. Every method raises `LinkError`, and nothing else, where the
    connection fails or the deadline passes.

    >>> from hardware import AbstractLink
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> link: AbstractLink = SimulatedLink(SimulatedAFG31052())
    >>> link.send(b"*IDN?\n", deadline=link.now() + 1.0)
    >>> link.receive(18, deadline=link.now() + 1.0).data
    b'TEKTRONIX,AFG31052'
    """

    resource: str

    @abc.abstractmethod
    def now(self) -> float:
        """Time on the link's clock, s; it never goes back."""

    @abc.abstractmethod
    def sleep(self, seconds: float) -> None:
        """Let time pass on the link's clock."""

    @abc.abstractmethod
    def send(self, data: bytes, deadline: float) -> None:
        """Send all of `data`, one message."""

    @abc.abstractmethod
    def receive(self, count: int, deadline: float) -> Received:
        """The next 1 to `count` bytes, as soon as there are any."""

    @abc.abstractmethod
    def unread(self) -> bytes:
        """What came and was not read, as far as can be seen without waiting; it is left there."""

    @abc.abstractmethod
    def reconnect(self, deadline: float) -> None:
        """Connect anew: nothing that was asked before can be answered on the new connection."""

    @abc.abstractmethod
    def close(self) -> None:
        """Disconnect; more than once does no harm."""
