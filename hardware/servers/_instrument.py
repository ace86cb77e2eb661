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


class AbstractSplitter(abc.ABC):
    """Cuts a stream of bytes into messages, so that those of two clients never mix."""

    @abc.abstractmethod
    def split(self, data: bytes) -> Iterable[bytes]:
        """The messages that `data` completes, with their ends; one too long is given cut."""


class Unsplit(AbstractSplitter):
    """Passes on what comes."""

    def split(self, data: bytes) -> Iterable[bytes]:
        """The bytes."""
        return (data,)


class Lines(AbstractSplitter):
    """Cuts at line ends. Of a line of more than `most` bytes, `most` are kept."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._line = bytearray()

    def split(self, data: bytes) -> Iterable[bytes]:
        """The lines that `data` completes, each with a newline; empty ones are left out."""
        found = []
        for part in data.replace(b"\r", b"\n").splitlines(keepends=True):
            self._line += part[: max(self._most - len(self._line), 0)]
            if part.endswith(b"\n"):
                line, self._line = bytes(self._line).rstrip(b"\n"), bytearray()
                found += [line + b"\n"] if line else []
        return found


class AbstractInstrument(abc.ABC):
    """A state machine: bytes in, answers out. One serves all transports.

    Settings outlive connections.
    """

    @abc.abstractmethod
    def feed(self, data: bytes) -> Iterable[Answer]:
        """Obey `data`, cut anywhere, and give what comes back, which may be without end."""

    def splitter(self) -> "AbstractSplitter":
        """What cuts a client's bytes into its messages, one for each client.

        By default the bytes are passed on as they come, which is right for one client alone.
        """
        return Unsplit()

    @abc.abstractmethod
    def connected(self) -> None:
        """A connection begins, or the transport clears the instrument: nothing is half-way."""
