"""An instrument behind HiSLIP, for `TCPIP::<address>::hislip0,<port>::INSTR`."""

import contextlib
import itertools
import socket
import struct
import threading
from collections.abc import Callable

from . import _hislip_wire as wire
from ._channel import Channel
from ._hislip_wire import Kind, message
from ._instrument import AbstractInstrument, Answer
from ._listener import LOOPBACK, AbstractListener
from ._thresholds import THRESHOLDS


class HislipServer(AbstractListener):
    """Serves one session after the other, by default to this computer alone.

    Synchronized mode of HiSLIP 1.0, without locks and service requests. Each answer says which
    message it is to, so that a late one is never taken for the next; a new session ends the one
    before. A context manager.
    """

    def __init__(
        self, instrument: AbstractInstrument, port: int = 0, *, host: str = LOOPBACK
    ) -> None:
        """`port`: 0 for any that is free; `host`: the address to listen at."""
        self._instrument = instrument
        self._numbers = itertools.cycle(range(1, 1 << 16))
        self._session: _Session | None = None
        super().__init__(port, host=host)

    @property
    def resource(self) -> str:
        """Its VISA address."""
        return f"TCPIP::{self.host}::hislip0,{self.port}::INSTR"

    def close(self) -> None:
        """Stop, and wait until all threads are done."""
        super().close()
        if self._session is not None:
            self._session.end()

    def _handle(self, connection: socket.socket) -> None:
        self._admit(Channel(connection, self._stop))

    def _admit(self, channel: Channel) -> None:
        """A new connection says what it is: the first channel of a session, or its second."""
        header, _ = channel.next(within_s=THRESHOLDS.first_message_s)
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

    def __init__(self, instrument: AbstractInstrument, first: Channel, number: int) -> None:
        self.number = number
        self._instrument = instrument
        self._first = first
        self._second: Channel | None = None
        self._threads: list[threading.Thread] = []
        self._cleared = threading.Event()  # what was asked before shall not be answered any more

    def begin(self, second: Channel) -> None:
        """Both channels are there."""
        self._second = second
        self._instrument.connected()
        for serve, channel in ((self._synchronous, self._first), (self._asynchronous, second)):
            thread = threading.Thread(target=self._guarded, args=(serve, channel), daemon=True)
            self._threads.append(thread)
            thread.start()

    def end(self) -> None:
        """Hang up, and wait for the threads."""
        self._disconnect()
        for thread in self._threads:
            thread.join()

    def _guarded(self, serve: Callable[[Channel], None], channel: Channel) -> None:
        with contextlib.suppress(OSError, ValueError):  # a closed socket has no number to wait for
            serve(channel)
        self._disconnect()

    def _disconnect(self) -> None:
        for channel in (self._first, self._second):
            if channel is not None:
                channel.close()

    def _synchronous(self, channel: Channel) -> None:
        while True:
            header, payload = channel.next()
            if header.kind in (Kind.DATA, Kind.DATA_END):
                if header.kind == Kind.DATA_END and not payload.endswith(b"\n"):
                    payload += b"\n"  # the end of a message needs no newline here
                for answer in self._instrument.feed(payload):
                    if self._cleared.is_set():
                        break
                    self._send_answer(answer, header.parameter)
            elif header.kind == Kind.CLEAR_COMPLETE:
                self._cleared.clear()
                self._instrument.connected()
                channel.send(message(Kind.CLEAR_ACKNOWLEDGE))
            elif header.kind != Kind.TRIGGER:
                channel.send(message(Kind.ERROR, 1))

    def _send_answer(self, answer: Answer, number: int) -> None:
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

    def _asynchronous(self, channel: Channel) -> None:
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
