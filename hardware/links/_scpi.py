"""A session with one SCPI instrument: every query is answered in time, or an error is raised."""

import contextlib
import re
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

from hardware._errors import InstrumentError, LinkError, escape, timed_out

from . import _reply
from ._link import AbstractLink, Received
from ._synchronisation import Synchronisation
from ._thresholds import THRESHOLDS

_T = TypeVar("_T")
_MOST_BYTES = 999_999
_SHOWN = 64  # bytes of a broken answer in a message
_BAD_STATUS = 0b0011_1100  # query, device, execution and command errors in *ESR?
_UNDEFINED_HEADER = -113
_CURE = "Check the setting against the instrument's range and firmware."


class Scpi:
    """Questions and commands, each with one deadline for all of its traffic.

    After a failure nothing that still comes is trusted: the next call connects again, and asks the
    instrument who it is before anything else. Nothing is ever sent twice. Every method raises
    `InstrumentError`, at most `timeout_s` after the call.

    >>> from hardware import Scpi
    >>> from hardware.simulated import SimulatedAFG31052, SimulatedLink
    >>> scpi = Scpi(SimulatedLink(SimulatedAFG31052()))
    >>> scpi.identify("TEKTRONIX,AFG31052,.*").split(",")[1]
    'AFG31052'
    >>> scpi.command("SOUR1:FREQ 20")
    >>> scpi.number("SOUR1:FREQ?")  # Hz
    20.0
    """

    def __init__(self, link: AbstractLink, *, timeout_s: float = 2.0) -> None:
        """`timeout_s`: for all traffic of one call, s."""
        if not 0 < timeout_s < float("inf"):
            raise ValueError(f"Argument `timeout_s` must be positive, but is {timeout_s}.")
        self._link = link
        self.timeout_s = timeout_s
        self._identity: str | None = None
        self._synchronisation = Synchronisation(link.resource)

    @property
    def resource(self) -> str:
        """Address of the instrument."""
        return self._link.resource

    def now(self) -> float:
        """Time on the link's clock, s."""
        return self._link.now()

    def sleep(self, seconds: float) -> None:
        """Let time pass on the link's clock."""
        self._link.sleep(seconds)

    def identify(self, pattern: str) -> str:
        """The instrument's `*IDN?`; refused where it does not match `pattern` as a whole."""
        identity = self.text("*IDN?")
        if not re.fullmatch(pattern, identity):
            raise InstrumentError(
                self.resource,
                "*IDN?",
                identity,
                why="This is another instrument than the one asked for.",
                cure="Check the address. Nothing was set.",
            )
        self._identity = identity
        return identity

    def text(self, query: str, pattern: str = r".+") -> str:
        """The answer to `query`, one printable line that must match `pattern` as a whole."""
        with self._call(query) as deadline:
            return self._ask(query, partial(_matching, pattern), deadline)

    def text_if_known(self, query: str) -> str | None:
        """The answer to `query`; `None` where the instrument reports an undefined header (-113).

        An unknown one takes `timeout_s`, and up to as long again to ask for the error. Raises
        `InstrumentError` where there is neither an answer nor this error.
        """
        try:
            return self.text(query)
        except InstrumentError:
            with self._call("SYST:ERR?") as deadline:
                self._ask("*ESR?", _status, deadline)  # else the next command would find it set
                codes = [code for code, _ in self._errors(deadline)]
            if _UNDEFINED_HEADER not in codes:
                raise
            return None

    def number(self, query: str) -> float:
        """The answer to `query`: a finite number, or infinity where the instrument says so."""
        with self._call(query) as deadline:
            return self._ask(query, _reply.number, deadline)

    def block(
        self, query: str, *, limit: int, size: int | None = None, timeout_s: float | None = None
    ) -> bytes:
        """The block that answers `query`: at most `limit` bytes, or exactly `size`.

        `timeout_s`: for a long one, instead of the session's own.
        """
        with self._call(query, timeout_s) as deadline:
            self._send(query.encode("ascii"), deadline)
            return _reply.read_block(_Receiver(self._link, deadline), limit=limit, size=size)

    def command(
        self,
        command: str,
        block: bytes | None = None,
        *,
        timeout_s: float | None = None,
        wait: bool = True,
    ) -> None:
        """Send `command`, with `block` behind it, wait until it is done, and empty the error queue.

        A block has at most 999 999 bytes: its length is written in six digits. `wait`: whether to
        ask for its end (`*OPC?`), which what goes on for long may delay. Raises `InstrumentError`
        where the instrument reports any error.
        """
        if block is not None and len(block) > _MOST_BYTES:
            raise ValueError(f"A block has at most {_MOST_BYTES} bytes, but this has {len(block)}.")
        head = command.encode("ascii")
        if block is not None:
            head += f",#6{len(block):06d}".encode("ascii")
        label = command if block is None else f"{head.decode()}<{len(block)} bytes>"
        with self._call(label, timeout_s) as deadline:
            self._send(head + (block or b""), deadline)
            if wait:
                self._ask("*OPC?", _done, deadline)
            status = self._ask("*ESR?", _status, deadline)
            errors = self._errors(deadline)
        if errors or status & _BAD_STATUS:
            listed = "; ".join(f'{code},"{text}"' for code, text in errors) or f"*ESR? {status}"
            raise InstrumentError(
                self.resource,
                label,
                listed,
                why="The instrument refuses the command, or reports an earlier fault.",
                cure=_CURE,
            )

    def clear(self) -> None:
        """Empty the instrument's status and error queue (`*CLS`)."""
        with self._call("*CLS") as deadline:
            self._send(b"*CLS", deadline)
            self._ask("*OPC?", _done, deadline)

    def resynchronise(self) -> None:
        """Connect again where an earlier call failed; nothing is sent where none did."""
        with self._call("*IDN?"):
            pass

    def close(self) -> None:
        """Disconnect."""
        self._link.close()

    def _errors(self, deadline: float) -> list[tuple[int, str]]:
        entries = []
        for _ in range(THRESHOLDS.most_errors):
            entry = self._ask("SYST:ERR?", _reply.error_entry, deadline)
            if entry[0] == 0:
                return entries
            entries.append(entry)
        raise LinkError(
            f"The error queue does not end after {THRESHOLDS.most_errors} entries.",
            "Restart the instrument.",
        )

    def _ask(self, query: str, parse: Callable[[str], _T], deadline: float) -> _T:
        self._send(query.encode("ascii"), deadline)
        line = _reply.read_line(_Receiver(self._link, deadline))
        try:
            return parse(line)
        except ValueError as error:
            raise _reply.malformed(
                f"The answer to {query} cannot be used: {error}.", line.encode()
            ) from None

    def _send(self, message: bytes, deadline: float) -> None:
        stray = self._link.unread()
        if stray:
            raise _reply.malformed("An answer came that nobody had asked for.", stray)
        self._link.send(message + b"\n", deadline)

    @contextlib.contextmanager
    def _call(self, label: str, timeout_s: float | None = None) -> Iterator[float]:
        deadline = self.now() + (self.timeout_s if timeout_s is None else timeout_s)
        with self._synchronisation.call(label):
            if self._synchronisation.lost:
                self._reconnect(deadline)
            yield deadline

    def _reconnect(self, deadline: float) -> None:
        self._link.reconnect(deadline)
        if self._identity is not None:
            identity = self._ask("*IDN?", str, deadline)
            if identity != self._identity:
                raise LinkError(
                    f"After connecting again, another instrument answers: '{escape(identity)}'.",
                    "Check the address.",
                    identity.encode(),
                )
        self._synchronisation.lost = False


class _Receiver:
    """Receives until a deadline, and remembers the first bytes for a message."""

    def __init__(self, link: AbstractLink, deadline: float) -> None:
        self._link = link
        self._began, self._deadline = link.now(), deadline
        self._got = bytearray()

    def __call__(self, count: int) -> Received:
        if self._link.now() >= self._deadline:  # a peer that never stops is not read for ever
            raise timed_out(self._deadline - self._began, bytes(self._got))
        try:
            received = self._link.receive(count, self._deadline)
        except LinkError as error:
            error.received = error.received or bytes(self._got)
            raise
        if len(received.data) > count or not (received.data or received.end):
            raise _reply.malformed("The connection gave nothing, or too much.", received.data)
        self._got += received.data[: max(0, _SHOWN - len(self._got))]
        return received


def _matching(pattern: str, line: str) -> str:
    if not re.fullmatch(pattern, line):
        raise ValueError("it has another form than the answer to this query")
    return line


def _done(line: str) -> None:
    if line != "1":
        raise ValueError("it must be 1")


def _status(line: str) -> int:
    if not re.fullmatch(r"\+?\d{1,3}", line) or int(line) > 255:
        raise ValueError("it must be a number from 0 to 255")
    return int(line)
