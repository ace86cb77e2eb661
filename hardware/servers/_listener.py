"""A server that listens at a port and handles one client after the other in its own thread."""

import abc
import select
import socket
import threading

from hardware._closes import ClosesOnExit

from ._thresholds import THRESHOLDS

LOOPBACK = "127.0.0.1"


class AbstractListener(ClosesOnExit):
    """A server, by default for this computer alone; a context manager."""

    def __init__(self, port: int = 0, *, host: str = LOOPBACK) -> None:
        """`port`: 0 for any that is free; `host`: the address to listen at."""
        self._socket = socket.create_server((host, port))
        self.host = host
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._socket.getsockname()[1]

    @property
    @abc.abstractmethod
    def resource(self) -> str:
        """Its VISA address."""

    @abc.abstractmethod
    def _handle(self, connection: socket.socket) -> None:
        """Serve a new connection, or have it served; whoever does closes it."""

    def close(self) -> None:
        """Stop, and wait until the thread is done."""
        self._stop.set()
        self._thread.join()
        self._socket.close()

    def _accept(self) -> None:
        while not self._stop.is_set():
            if not select.select([self._socket], [], [], THRESHOLDS.tick_s)[0]:
                continue
            connection, _ = self._socket.accept()
            try:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._handle(connection)
            except OSError:
                connection.close()
