"""The interface of a simulated instrument, whatever transport carries its bytes."""

import abc
from collections.abc import Iterable
from typing import NamedTuple


class Answer(NamedTuple):
    """Something that an instrument does after it was fed.

    - `data`: bytes that it sends, one whole message of it or a part.
    - `after_s`: how long after the answer before, or after the feeding.
    - `hang_up`: the connection ends with it. `deaf`: nothing is read from now on.
    """

    data: bytes
    after_s: float = 0.0
    hang_up: bool = False
    deaf: bool = False


class AbstractInstrument(abc.ABC):
    """A state machine: bytes in, answers out. One serves all transports.

    Settings outlive connections.
    """

    @abc.abstractmethod
    def feed(self, data: bytes) -> Iterable[Answer]:
        """Obey `data`, cut anywhere, and give what comes back, which may be without end."""

    @abc.abstractmethod
    def connected(self) -> None:
        """A connection begins, or the transport clears the instrument: nothing is half-way."""
