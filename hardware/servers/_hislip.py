"""An instrument behind HiSLIP, for `TCPIP::<address>::hislip0,<port>::INSTR`."""

import contextlib
import itertools
import select
import socket
import struct
import threading
import time
from collections.abc import Callable

from .._closes import ClosesOnExit
from . import _hislip_wire as wire
from ._hislip_wire import Header, Kind, Malformed, message
from ._instrument import AbstractInstrument, Answer
from ._tcp import LOOPBACK

_TICK_S = 0.02  # how often a waiting thread looks whether it shall stop


class HislipServer(ClosesOnExit):
    """Serves one session after the other, to this computer alone if not told otherwise.

    Synchronized mode of HiSLIP 1.0, without locks and service requests. Each answer says which
    message it is to, so that a late one is never taken for the next; a new session ends the one
    before. A context manager.
    """

    def __init__(
        self, instrument: AbstractInstrument, port: int = 0, *, host: str = LOOPBACK
    ) -> None:
        """`port`: 0 for any that is free; `host`: the address to listen at."""
        self._instrument = instrument
        self._listener = socket.create_server((host, port))
        self.host = host
        self._stop = threading.Event()
        self._numbers = itertools.cycle(range(1, 1 << 16))
        self._session: _Session | None = None
        self._thread = threading.Thread(target=self._accept, daemon=True)
        self._thread.start()

    @property
    def port(self) -> int:
        """Where it listens."""
        return self._listener.getsockname()[1]

    @property
    def resource(self) -> str:
        """Its VISA address."""
        return f"TCPIP::{self.host}::hislip0,{self.port}::INSTR"

    def close(self) -> None:
        """Stop, and wait until all threads are done."""
        self._stop.set()
        self._thread.join()
        if self._session is not None:
            self._session.end()
        self._listener.close()

    def _accept(self) -> None:
        while not self._stop.is_set():
            if not select.select([self._listener], [], [], _TICK_S)[0]:
                continue
            connection, _ = self._listener.accept()
            try:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._admit(_Channel(connection, self._stop))
            except OSError:
                connection.close()

    def _admit(self, channel: "_Channel") -> None:
        """A new connection says what it is: the first channel of a session, or its second."""
        header, _ = channel.next(within_s=5.0)
        if header.kind == Kind.INITIALIZE:
            if self._session is not None:
                self._session.end()
            self._session = _Session(self._instrument, channel, next(self._numbers))
            first = wire.VERSION << 16 | self._session.number
            channel.send(message(Kind.INITIALIZE_RESPONSE, 0, first))
        elif (
            header.kind == Kind.ASYNC_INITIALIZE
            and self._session is not None
            and header.parameter == self._session.number
        ):
            channel.send(message(Kind.ASYNC_INITIALIZE_RESPONSE))
            self._session.begin(channel)
        else:
            channel.send(message(Kind.FATAL_ERROR, 3))
            channel.close()


class _Session:
    """Two channels to one client, each served by a thread of its own."""

    def __init__(self, instrument: AbstractInstrument, first: "_Channel", number: int) -> None:
        self.number = number
        self._instrument = instrument
        self._first = first
        self._second: _Channel | None = None
        self._threads: list[threading.Thread] = []
        self._cleared = threading.Event()  # what was asked before shall not be answered any more

    def begin(self, second: "_Channel") -> None:
        """Both channels are there."""
        self._second = second
        self._instrument.connected()
        for serve, channel in ((self._synchronous, self._first), (self._asynchronous, second)):
            thread = threading.Thread(target=self._guarded, args=(serve, channel), daemon=True)
            self._threads.append(thread)
            thread.start()

    def end(self) -> None:
        """Hang up, and wait for the threads."""
        self._hang_up()
        for thread in self._threads:
            thread.join()

    def _guarded(self, serve: Callable[["_Channel"], None], channel: "_Channel") -> None:
        with contextlib.suppress(OSError, ValueError):  # a closed socket has no number to wait for
            serve(channel)
        self._hang_up()

    def _hang_up(self) -> None:
        for channel in (self._first, self._second):
            if channel is not None:
                channel.close()

    def _synchronous(self, channel: "_Channel") -> None:
        while True:
            header, payload = channel.next()
            if header.kind in (Kind.DATA, Kind.DATA_END):
                if header.kind == Kind.DATA_END and not payload.endswith(b"\n"):
                    payload += b"\n"  # the end of a message needs no newline here
                for answer in self._instrument.feed(payload):
                    if self._cleared.is_set():
                        break
                    self._give(answer, header.parameter)
            elif header.kind == Kind.CLEAR_COMPLETE:
                self._cleared.clear()
                self._instrument.connected()
                channel.send(message(Kind.CLEAR_ACKNOWLEDGE))
            elif header.kind != Kind.TRIGGER:
                channel.send(message(Kind.ERROR, 1))

    def _give(self, answer: Answer, number: int) -> None:
        self._first.wait(answer.after_s, self._cleared)
        if answer.data and not self._cleared.is_set():
            room = wire.MOST - wire.SIZE
            for at in range(0, len(answer.data), room):
                part = answer.data[at : at + room]
                last = at + room >= len(answer.data) and part.endswith(b"\n")
                kind = Kind.DATA_END if last else Kind.DATA
                self._first.send(message(kind, 0, number, part))
        if answer.deaf:
            self._first.wait(float("inf"), threading.Event())
        if answer.hang_up:
            raise ConnectionAbortedError

    def _asynchronous(self, channel: "_Channel") -> None:
        while True:
            header, payload = channel.next()
            if header.kind == Kind.ASYNC_MAXIMUM:
                asked = int.from_bytes(payload, "big") if len(payload) == 8 else wire.MOST
                size = struct.pack("!Q", min(asked, wire.MOST))
                channel.send(message(Kind.ASYNC_MAXIMUM_RESPONSE, payload=size))
            elif header.kind == Kind.ASYNC_CLEAR:
                self._cleared.set()
                channel.send(message(Kind.ASYNC_CLEAR_ACKNOWLEDGE))
            elif header.kind == Kind.ASYNC_STATUS:
                channel.send(message(Kind.ASYNC_STATUS_RESPONSE))
            elif header.kind == Kind.ASYNC_REMOTE_LOCAL:
                channel.send(message(Kind.ASYNC_REMOTE_LOCAL_RESPONSE))
            elif header.kind == Kind.ASYNC_LOCK:
                channel.send(message(Kind.ASYNC_LOCK_RESPONSE, 1))
            elif header.kind == Kind.ASYNC_LOCK_INFO:
                channel.send(message(Kind.ASYNC_LOCK_INFO_RESPONSE))
            else:
                channel.send(message(Kind.ERROR, 1))


class _Channel:
    """Messages over one connection, until somebody stops it."""

    def __init__(self, connection: socket.socket, stop: threading.Event) -> None:
        self._connection = connection
        self._stop = stop
        connection.settimeout(_TICK_S)

    def next(self, within_s: float = float("inf")) -> tuple[Header, bytes]:
        """The next message. Raises `OSError` where there is none any more."""
        until = time.monotonic() + within_s
        header = Header.of(self._exactly(wire.SIZE, until))
        return header, self._exactly(header.length, until)

    def send(self, data: bytes) -> None:
        """All of `data`; raises `OSError` where it cannot be."""
        left = memoryview(data)
        while left:
            self._look()
            with contextlib.suppress(TimeoutError):
                left = left[self._connection.send(left) :]

    def wait(self, seconds: float, until: threading.Event) -> None:
        """Let time pass; raises `OSError` where the client hangs up meanwhile."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and not until.wait(min(left, _TICK_S)):
            self._look()
            readable = select.select([self._connection], [], [], 0.0)[0]
            if readable and not self._connection.recv(1, socket.MSG_PEEK):
                raise ConnectionAbortedError

    def close(self) -> None:
        """Hang up; a thread that waits here ends."""
        with contextlib.suppress(OSError):
            self._connection.shutdown(socket.SHUT_RDWR)
        self._connection.close()

    def _exactly(self, count: int, until: float) -> bytes:
        got = bytearray()
        while len(got) < count:
            self._look()
            if time.monotonic() > until:
                raise Malformed("no message came")
            with contextlib.suppress(TimeoutError):
                data = self._connection.recv(min(count - len(got), 1 << 16))
                if not data:
                    raise ConnectionAbortedError
                got += data
        return bytes(got)

    def _look(self) -> None:
        if self._stop.is_set():
            raise ConnectionAbortedError
