"""A server that listens at a port; each client is served by a thread of its own."""

import abc
import contextlib
import select
import socket
import threading

from hardware._closes import ClosesOnExit

from ._thresholds import THRESHOLDS

LOOPBACK = "127.0.0.1"


class AbstractListener(ClosesOnExit):
    """A server, by default for this computer alone; a context manager.

    Whatever a client sends, or leaves unsent, delays no other client: what begins a connection is
    read in that client's own thread, too. Beyond `most_clients` a connection is closed at once.
    """

    def __init__(self, port: int = 0, *, host: str = LOOPBACK) -> None:
        """`port`: 0 for any that is free; `host`: the address to listen at."""
        self._socket = socket.create_server((host, port))
        self.host = host
        self._stop = threading.Event()
        self._clients: set[threading.Thread] = set()
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
    def _serve_client(self, connection: socket.socket) -> None:
        """Serve a new connection, in a thread of its own, until it ends."""

    def close(self) -> None:
        """Stop, and wait until all threads are done."""
        self._stop.set()
        self._thread.join()
        self._socket.close()
        for client in list(self._clients):
            client.join()

    def _accept(self) -> None:
        while not self._stop.is_set():
            if not select.select([self._socket], [], [], THRESHOLDS.tick_s)[0]:
                continue
            try:
                connection, _ = self._socket.accept()
            except OSError:  # the client went away meanwhile, or there are no more descriptors
                self._stop.wait(THRESHOLDS.tick_s)
                continue
            self._clients = {one for one in self._clients if one.is_alive()}
            if len(self._clients) >= THRESHOLDS.most_clients:
                connection.close()
                continue
            client = threading.Thread(target=self._guarded, args=(connection,), daemon=True)
            self._clients.add(client)
            client.start()

    def _guarded(self, connection: socket.socket) -> None:
        """Serve a client; what it does wrong ends its own connection alone."""
        with connection, contextlib.suppress(OSError, ValueError):  # ValueError: a closed socket
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            keep_alive(connection)
            self._serve_client(connection)


def keep_alive(connection: socket.socket) -> None:
    """Let a client that lost its power be noticed, in some ten seconds where the system can."""
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (("TCP_KEEPIDLE", 5), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, name):
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
