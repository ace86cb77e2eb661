"""A link that plays a written conversation: every byte sent must be the next one of it."""

from hardware import AbstractLink
from hardware.links._link import Received

DONE = (("*OPC?", "1"), ("*ESR?", "0"), ("SYST:ERR?", '0,"No error"'))


class Transcript(AbstractLink):
    """`Transcript((sent, reply), ...)`: `reply` is `None` for a command; a context manager."""

    def __init__(self, *lines):
        self.resource = "TRANSCRIPT"
        self._lines = list(lines)
        self._reply = b""

    def __enter__(self):
        return self

    def __exit__(self, kind, error, trace):
        if kind is None:
            assert not self._lines, f"never sent: {self._lines}"

    @property
    def whole(self):
        """Whether every line was sent."""
        return not self._lines

    def now(self) -> float:
        return 0.0

    def sleep(self, seconds: float) -> None:
        pass

    def send(self, data: bytes, deadline: float) -> None:
        assert self._lines, f"sent more than was written: {data!r}"
        sent, reply = self._lines.pop(0)
        expected = (sent if isinstance(sent, bytes) else sent.encode()) + b"\n"
        assert data == expected
        reply = b"" if reply is None else reply
        self._reply = reply and (reply if isinstance(reply, bytes) else reply.encode()) + b"\n"

    def receive(self, count: int, deadline: float) -> Received:
        data, self._reply = self._reply[:count], self._reply[count:]
        return Received(data, False)

    def unread(self) -> bytes:
        return self._reply

    def reconnect(self, deadline: float) -> None:
        raise AssertionError("nothing of this conversation may fail")

    def close(self) -> None:
        pass


def command(text):
    """A command and the empty error queue behind it."""
    return ((text, None), *DONE)
