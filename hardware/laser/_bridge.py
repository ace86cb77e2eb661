"""A bridge that puts a laser controller on the network, whatever link reaches it.

The TLB-6700 speaks through the vendor's Windows library alone. On the computer that has it:

    with VendorDllLink("SN1012") as link, HislipServer(Bridge(link)) as server:
        print(server.resource)

and anywhere else `VisaLaserLink(VisaLink(resource))`.
"""

from collections.abc import Iterator

from hardware._errors import InstrumentError, escape
from hardware.servers._instrument import AbstractInstrument, Answer

from . import _commands as commands
from ._link import AbstractLaserLink

REFUSED = "BRIDGE: "
_MOST = commands.MOST_BYTES - 2


class Bridge(AbstractInstrument):
    """Each line is passed on, and its answer given back, 62 bytes at most.

    What goes wrong behind the bridge is answered by a line that begins with `BRIDGE: `, which no
    setter takes for `OK` and no query for a number.
    """

    def __init__(self, link: AbstractLaserLink) -> None:
        self._link = link
        self._buffer = bytearray()

    def connected(self) -> None:
        """Drop a line that was not complete."""
        self._buffer.clear()

    def feed(self, data: bytes) -> Iterator[Answer]:
        """Answers to the lines that `data` completes."""
        for byte in data:
            if byte in b"\r\n":
                line, self._buffer = bytes(self._buffer), bytearray()
                if line:
                    yield Answer(self._answer(line) + b"\r\n")
            elif len(self._buffer) <= _MOST:  # one too long is refused at its end
                self._buffer.append(byte)

    def _answer(self, line: bytes) -> bytes:
        if len(line) > _MOST or any(not 32 <= byte <= 126 for byte in line):
            return _refused("the line is too long, or not printable")
        try:
            reply = self._link.query(line.decode("ascii"))
        except InstrumentError as error:
            return _refused(error.reply or "no answer")
        data = reply.encode("ascii", "backslashreplace")
        return data if 0 < len(data) <= _MOST else _refused("the answer is too long")


def _refused(why: str) -> bytes:
    return (REFUSED + escape(why)).encode("ascii", "backslashreplace")[:_MOST]
