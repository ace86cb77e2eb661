"""One connection of a HiSLIP session, as messages."""

import contextlib
import select
import socket
import threading
import time

from . import _hislip_wire as wire
from ._hislip_wire import Header, Malformed
from ._thresholds import THRESHOLDS


class Channel:
    """Messages over one connection, until somebody stops it."""

    def __init__(self, connection: socket.socket, stop: threading.Event) -> None:
        self._connection = connection
        self._stop = stop
        connection.settimeout(THRESHOLDS.tick_s)

    def next(self, within_s: float = float("inf")) -> tuple[Header, bytes]:
        """The next message. Raises `OSError` where there is none any more."""
        until = time.monotonic() + within_s
        header = Header.of(self._exactly(wire.SIZE, until))
        return header, self._exactly(header.length, until)

    def send(self, data: bytes) -> None:
        """All of `data`; raises `OSError` where it cannot be."""
        left = memoryview(data)
        while left:
            self._raise_if_stopped()
            with contextlib.suppress(TimeoutError):
                left = left[self._connection.send(left) :]

    def wait(self, seconds: float, until: threading.Event) -> None:
        """Let time pass; raises `OSError` where the client hangs up meanwhile."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and not until.wait(min(left, THRESHOLDS.tick_s)):
            self._raise_if_stopped()
            readable = select.select([self._connection], [], [], 0.0)[0]
            if readable and not self._connection.recv(1, socket.MSG_PEEK):
                raise ConnectionAbortedError

    def close(self) -> None:
        """Disconnect; a thread that waits here ends."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()

    def _exactly(self, count: int, until: float) -> bytes:
        got = bytearray()
        while len(got) < count:
            self._raise_if_stopped()
            if time.monotonic() > until:
                raise Malformed("no message came")
            with contextlib.suppress(TimeoutError):
                data = self._connection.recv(min(count - len(got), THRESHOLDS.receive_bytes))
                if not data:
                    raise ConnectionAbortedError
                got += data
        return bytes(got)

    def _raise_if_stopped(self) -> None:
        if self._stop.is_set():
            raise ConnectionAbortedError
