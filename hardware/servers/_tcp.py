"""An instrument on a TCP port, for `TCPIP::<address>::<port>::SOCKET`."""

import select
import socket
import time

from ._instrument import AbstractInstrument, Answer
from ._listener import LOOPBACK, AbstractListener
from ._shared import SharedInstrument
from ._thresholds import THRESHOLDS

_QUICKACK = getattr(socket, "TCP_QUICKACK", None)  # Linux


class TcpServer(AbstractListener):
    r"""Serves each client in a thread of its own, by default on this computer alone.

    Acknowledges at once: a small upload would otherwise stall for 44 ms, where a client waits for
    the acknowledgement of one piece before it sends the next. A context manager.

    >>> import socket
    >>> from hardware import TcpServer
    >>> from hardware.simulated import SimulatedAFG31052
    >>> with TcpServer(SimulatedAFG31052()) as server:
    ...     with socket.create_connection((server.host, server.port), timeout=5.0) as client:
    ...         client.sendall(b"*IDN?\n")
    ...         answer = client.makefile().readline()
    >>> answer.split(",")[1]
    'AFG31052'
    """

    def __init__(
        self, instrument: AbstractInstrument, port: int = 0, *, host: str = LOOPBACK
    ) -> None:
        """`port`: 0 for any that is free; `host`: the address to listen at."""
        self._instrument = SharedInstrument(instrument)
        super().__init__(port, host=host)

    @property
    def resource(self) -> str:
        """Its VISA address."""
        return f"TCPIP::{self.host}::{self.port}::SOCKET"

    def _serve_client(self, connection: socket.socket) -> None:
        self._instrument.connected()
        splitter = self._instrument.instrument.splitter()
        while not self._stop.is_set():
            if not select.select([connection], [], [], THRESHOLDS.tick_s)[0]:
                continue
            if _QUICKACK is not None:
                connection.setsockopt(socket.IPPROTO_TCP, _QUICKACK, 1)
            data = connection.recv(THRESHOLDS.receive_bytes)
            if not data:
                return
            for message in splitter.split(data):
                for answer in self._instrument.feed(message):
                    if not self._send_answer(connection, answer):
                        return

    def _send_answer(self, connection: socket.socket, answer: Answer) -> bool:
        """Whether the connection goes on."""
        if answer.after_s and not self._wait(connection, answer.after_s):
            return False
        data = memoryview(answer.data)
        while data:
            if self._stop.is_set():
                return False
            if select.select([], [connection], [], THRESHOLDS.tick_s)[1]:
                data = data[connection.send(data[: THRESHOLDS.send_bytes]) :]
            elif self._peer_closed(connection):
                return False
        while answer.deaf and not self._stop.wait(THRESHOLDS.tick_s):
            pass
        return not answer.hang_up

    def _wait(self, connection: socket.socket, seconds: float) -> bool:
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if self._stop.wait(min(left, THRESHOLDS.tick_s)) or self._peer_closed(connection):
                return False
        return True

    def _peer_closed(self, connection: socket.socket) -> bool:
        if not select.select([connection], [], [], 0.0)[0]:
            return False
        return not connection.recv(1, socket.MSG_PEEK)
