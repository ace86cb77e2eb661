"""A bridge that puts a laser controller on the network, whatever link reaches it.

The TLB-6700 speaks through the vendor's Windows library alone. On the computer that has it:

    with VendorDllLink("SN1012") as link, HislipServer(Bridge(link), alone=True) as server:
        print(server.resource)

and anywhere else `VisaLaserLink(VisaLink(resource))`.
"""

import hmac
from collections.abc import Iterator

from hardware._errors import InstrumentError, escape
from hardware.servers._instrument import AbstractInstrument, Answer, Lines
from rapi_jax import DataError, LimitError
from rapi_jax.internal import StrPath, read_text
from rapi_jax.io import printable

from . import _commands as commands
from ._allowed import refusal
from ._limits import LaserLimits
from ._link import AbstractLaserLink
from ._thresholds import THRESHOLDS

REFUSED = "BRIDGE: "
TOKEN = "TOKEN "  # noqa: S105 (the command, no secret)
_MOST = commands.MOST_BYTES - 2
_LINE = 262  # bytes of a line that are kept: a token is longer than a command


class Bridge(AbstractInstrument):
    """Each line is passed on, and its answer given back, 62 bytes at most.

    What is refused, or goes wrong behind the bridge, is answered by a line that begins with
    `BRIDGE: `, which no setter takes for `OK` and no query for a number. Only the commands that
    are listed in `_allowed` are passed on. For one client at a time: `HislipServer(alone=True)`.

    >>> from hardware import Bridge, VisaLaserLink
    >>> from hardware.simulated import SimulatedLink, SimulatedTLB6700
    >>> there = VisaLaserLink(SimulatedLink(SimulatedTLB6700()))  # or `VendorDllLink("SN1012")`
    >>> bridged = VisaLaserLink(SimulatedLink(Bridge(there)))
    >>> bridged.query("SYSTem:LASer:MODEL?")
    'TLB-6712'
    >>> bridged.query("*RST")[:8]
    'BRIDGE: '
    """

    def __init__(
        self, link: AbstractLaserLink, *, limits: LaserLimits | None = None, token: str = ""
    ) -> None:
        """`limits`: what may be set; without them that is left to the client. `token`: what a
        client must send first, as `TOKEN <token>`; none where it is empty.
        """
        self._link = link
        self._limits = limits
        self._token = token
        self._admitted = not token
        self._buffer = bytearray()

    def splitter(self) -> Lines:
        """Of one client's lines."""
        return Lines(_LINE)

    def connected(self) -> None:
        """Drop a line that was not complete; a client must name the token again."""
        self._buffer.clear()
        self._admitted = not self._token

    def feed(self, data: bytes) -> Iterator[Answer]:
        """Answers to the lines that `data` completes."""
        for byte in data:
            if byte in b"\r\n":
                line, self._buffer = bytes(self._buffer), bytearray()
                if line:
                    yield self._admit(line) if self._is_token(line) else self._pass(line)
            elif len(self._buffer) < _LINE:  # one too long is refused at its end
                self._buffer.append(byte)

    def _is_token(self, line: bytes) -> bool:
        return bool(self._token) and line.upper().startswith(TOKEN.encode())

    def _admit(self, line: bytes) -> Answer:
        """Compare the token; a wrong one is answered late, and the connection ends."""
        given = line[len(TOKEN) :].strip()
        self._admitted = hmac.compare_digest(given, self._token.encode())
        if self._admitted:
            return Answer(b"OK\r\n")
        wait = THRESHOLDS.wrong_token_s
        return Answer(_refused("the token is wrong") + b"\r\n", after_s=wait, hang_up=True)

    def _pass(self, line: bytes) -> Answer:
        if not self._admitted:
            return Answer(_refused("send TOKEN and the token first") + b"\r\n", hang_up=True)
        return Answer(self._answer(line) + b"\r\n")

    def _answer(self, line: bytes) -> bytes:
        if len(line) > _MOST or any(not 32 <= byte <= 126 for byte in line):
            return _refused("the line is too long, or not printable")
        command = line.decode("ascii")
        try:
            if why := refusal(command, self._limits):
                return _refused(why)
            reply = self._link.query(command)
        except InstrumentError as error:
            return _refused(error.reply or "no answer")
        except LimitError as error:
            return _refused(str(error))
        data = reply.encode("ascii", "backslashreplace")
        return data if 0 < len(data) <= _MOST else _refused("the answer is too long")


def _refused(why: str) -> bytes:
    return (REFUSED + escape(why)).encode("ascii", "backslashreplace")[:_MOST]


def read_bridge_token(path: StrPath) -> str:
    """The shared token in a file of one line. Raises `DataError` where it is none, or too short.

    >>> from pathlib import Path
    >>> from hardware import read_bridge_token
    >>> _ = Path("token.txt").write_text("0123456789abcdef" * 2)
    >>> len(read_bridge_token("token.txt"))
    32
    """
    label = printable(path)
    text = read_text(path, _LINE).strip()
    if not (16 <= len(text) <= 200 and text.isascii() and text.isprintable()):
        raise DataError(
            f"{label}: a token is one line of 16 to 200 printable ASCII characters. Write one, as "
            "`python -c 'import secrets; print(secrets.token_hex(16))'` makes it."
        )
    return text
