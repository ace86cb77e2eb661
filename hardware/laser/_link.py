"""Connections to a laser controller: one command out, one line back."""

import abc

from hardware._closes import ClosesOnExit
from hardware._errors import LinkError, timed_out
from hardware.links import _reply
from hardware.links._link import AbstractLink, Received
from hardware.links._synchronisation import Synchronisation

from . import _commands as commands

_MOST = 2 * commands.MOST_BYTES  # an answer, and an identity behind it


class AbstractLaserLink(ClosesOnExit):
    """A connection to one controller, with its own clock (real, or that of a simulation).

    A context manager.

    >>> from hardware import AbstractLaserLink, VisaLaserLink
    >>> from hardware.simulated import SimulatedLink, SimulatedTLB6700
    >>> link: AbstractLaserLink = VisaLaserLink(SimulatedLink(SimulatedTLB6700()))
    >>> link.query("SYSTem:LASer:MODEL?")
    'TLB-6712'
    """

    resource: str

    @abc.abstractmethod
    def query(self, command: str) -> str:
        """The line that answers `command`, without its end: `OK`, a value, or a complaint.

        What nobody asked for is left out: an identity, whole or cut, and an `OK` beside the answer
        of a query. Raises `InstrumentError` where there is
        no answer in time.
        """

    @abc.abstractmethod
    def now(self) -> float:
        """Time on the link's clock, s; it never goes back."""

    @abc.abstractmethod
    def sleep(self, seconds: float) -> None:
        """Let time pass on the link's clock."""


def select_answer(command: str, lines: list[str]) -> str:
    """The one line of several that answers `command`; `ValueError` where that is not clear."""
    asked = command.strip().upper() == "*IDN?"
    found = [line for line in lines if line and (asked or not commands.is_stray(line))]
    if commands.is_query(command):  # an `OK` beside a value belongs to no setter
        found = [line for line in found if line != "OK"]
    if not found:
        raise ValueError("there is no line in it but an identity that nobody had asked for")
    if len(found) > 1:
        raise ValueError("there is more than one line in it")
    return found[0]


class VisaLaserLink(AbstractLaserLink):
    """A controller behind a connection of bytes: a bridge, or the simulated laboratory.

    After a failure nothing that still comes is trusted: the next command connects again.

    >>> from hardware import VisaLaserLink
    >>> from hardware.simulated import SimulatedLink, SimulatedTLB6700
    >>> with VisaLaserLink(SimulatedLink(SimulatedTLB6700())) as link:
    ...     link.query("SOURce:VOLTage:PIEZo 40"), link.query("SOURce:VOLTage:PIEZo?")
    ('OK', '40.00')
    """

    def __init__(self, link: AbstractLink, *, timeout_s: float = 2.0, token: str = "") -> None:
        """`timeout_s`: for one command and its answer, s. `token`: of a bridge that asks for it."""
        if not 0 < timeout_s < float("inf"):
            raise ValueError(f"Argument `timeout_s` must be positive, but is {timeout_s}.")
        self._link = link
        self.resource = link.resource
        self.timeout_s = timeout_s
        self._synchronisation = Synchronisation(link.resource)
        self._pending = b""  # received, and not read yet
        self._token, self._admitted = token, not token

    def now(self) -> float:
        """Time on the link's clock, s."""
        return self._link.now()

    def sleep(self, seconds: float) -> None:
        """Let time pass on the link's clock."""
        self._link.sleep(seconds)

    def query(self, command: str) -> str:
        """The line that answers `command`."""
        deadline = self.now() + self.timeout_s
        with self._synchronisation.call(command):
            if self._synchronisation.lost:
                self._link.reconnect(deadline)
                self._synchronisation.lost, self._pending = False, b""
                self._admitted = not self._token
            if not self._admitted:
                self._link.send(f"TOKEN {self._token}\r\n".encode("ascii"), deadline)
                if (said := self._line(deadline)) != "OK":
                    raise LinkError(
                        "The bridge did not take the token.",
                        "Give `token` in the bench file's [laser], as `rapi bench bridge` has it.",
                        said.encode("ascii", "replace"),
                    )
                self._admitted = True
            self._drop_strays(deadline)
            self._link.send(command.encode("ascii") + b"\r\n", deadline)
            while True:
                line = self._line(deadline)
                if commands.is_query(command) and line == "OK":
                    continue
                if not commands.is_stray(line) or command.strip().upper() == "*IDN?":
                    return line

    def close(self) -> None:
        """Disconnect."""
        self._link.close()

    def _drop_strays(self, deadline: float) -> None:
        """Discard an identity or an `OK` that came late; anything else is out of step.

        An `OK` that comes later still answers no query, and behind a setter the look at the status
        and what is read back decide.
        """
        while there := self._pending or self._link.unread():
            line = self._line(deadline) if b"\n" in there else ""
            if line != "OK" and not commands.is_stray(line):
                raise _reply.malformed("An answer came that nobody had asked for.", there)

    def _line(self, deadline: float) -> str:
        """One line; what comes with it and behind it is kept."""
        began = self.now()
        while b"\n" not in self._pending:
            if len(self._pending) > _MOST:
                raise _reply.malformed(f"A line has more than {_MOST} bytes.", self._pending)
            if self.now() >= deadline:
                raise timed_out(deadline - began, self._pending)
            data, end = self._link.receive(_MOST, deadline)
            self._pending += data
            if end and not data.endswith(b"\n"):
                self._pending += b"\n"
        line, _, self._pending = self._pending.partition(b"\n")
        return _reply.read_line(lambda _: Received(line + b"\n", True), limit=commands.MOST_BYTES)
