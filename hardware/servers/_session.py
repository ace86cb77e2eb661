"""One client's session of HiSLIP: its two channels, each served by the thread it came in."""

import contextlib
import struct
import threading
import time
from collections.abc import Mapping

from . import _hislip_wire as wire
from ._channel import Channel
from ._hislip_wire import Header, Kind, message
from ._instrument import Answer
from ._shared import SharedInstrument
from ._thresholds import THRESHOLDS

_FAILURE, _SUCCESS, _ERROR = 0, 1, 3  # answers to a request for the lock


class Session:
    """What one client said so far, and whether it holds the lock of the instrument.

    `sessions`: all that are served, by number; `changed`: guards them and their locks.
    """

    def __init__(
        self,
        number: int,
        first: Channel,
        instrument: SharedInstrument,
        sessions: "Mapping[int, Session]",
        changed: threading.Condition,
    ) -> None:
        self.number = number
        self.ready = threading.Event()  # the second channel is there
        self.holds_lock = False
        self._first = first
        self._second: Channel | None = None
        self._instrument = instrument
        self._splitter = instrument.instrument.splitter()
        self._sessions, self._changed = sessions, changed
        self._cleared = threading.Event()  # what was asked before shall not be answered any more

    def join(self, second: Channel) -> bool:
        """Take the second channel; whether there was none before."""
        with self._changed:
            if self._second is not None:
                return False
            self._second = second
            return True

    def wait_for_second(self, stop: threading.Event) -> bool:
        """Whether the second channel came in time."""
        until = time.monotonic() + THRESHOLDS.first_message_s
        while not self.ready.wait(THRESHOLDS.tick_s):
            if stop.is_set() or time.monotonic() > until:
                return False
        return True

    def close(self) -> None:
        """Hang up, and release the lock."""
        for channel in (self._first, self._second):
            if channel is not None:
                channel.close()
        with self._changed:
            self.holds_lock = False
            self._changed.notify_all()

    def serve_first(self) -> None:
        """Obey and answer, until the client hangs up: raises `OSError` then."""
        while True:
            header, payload = self._first.next()
            if header.kind in (Kind.DATA, Kind.DATA_END):
                if header.kind == Kind.DATA_END and not payload.endswith(b"\n"):
                    payload += b"\n"  # the end of a message needs no newline here
                self._wait_for_lock()
                self._obey(payload, header.parameter)
            elif header.kind == Kind.CLEAR_COMPLETE:
                self._cleared.clear()
                self._splitter = self._instrument.instrument.splitter()
                self._instrument.connected()
                self._first.send(message(Kind.CLEAR_ACKNOWLEDGE))
            elif header.kind != Kind.TRIGGER:
                self._first.send(message(Kind.ERROR, 1))

    def serve_second(self) -> None:
        """Answer about sizes, locks and status, until the client hangs up."""
        channel = self._second
        if channel is None:
            raise ConnectionAbortedError
        try:
            while True:
                channel.send(self._answer_second(*channel.next()))
        finally:
            self.close()

    def _obey(self, payload: bytes, number: int) -> None:
        for one in self._splitter.split(payload):
            for answer in self._instrument.feed(one):
                if self._cleared.is_set():
                    return
                self._send_answer(answer, number)

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

    def _answer_second(self, header: Header, payload: bytes) -> bytes:
        if header.kind == Kind.ASYNC_MAXIMUM:
            asked = int.from_bytes(payload, "big") if len(payload) == 8 else wire.MOST
            size = struct.pack("!Q", min(asked, wire.MOST))
            return message(Kind.ASYNC_MAXIMUM_RESPONSE, payload=size)
        if header.kind == Kind.ASYNC_CLEAR:
            self._cleared.set()
            return message(Kind.ASYNC_CLEAR_ACKNOWLEDGE)
        if header.kind == Kind.ASYNC_STATUS:
            return message(Kind.ASYNC_STATUS_RESPONSE)
        if header.kind == Kind.ASYNC_REMOTE_LOCAL:
            return message(Kind.ASYNC_REMOTE_LOCAL_RESPONSE)
        if header.kind == Kind.ASYNC_LOCK:
            return message(Kind.ASYNC_LOCK_RESPONSE, self._change_lock(header))
        if header.kind == Kind.ASYNC_LOCK_INFO:
            held = sum(one.holds_lock for one in list(self._sessions.values()))
            return message(Kind.ASYNC_LOCK_INFO_RESPONSE, min(held, 1), held)
        return message(Kind.ERROR, 1)

    def _change_lock(self, header: Header) -> int:
        """Take or release the lock; `header.parameter`: how long to wait for it, ms."""
        with self._changed:
            if header.control != 1:
                held, self.holds_lock = self.holds_lock, False
                self._changed.notify_all()
                return _SUCCESS if held else _ERROR
            if self.holds_lock:
                return _ERROR
            wait_s = min(header.parameter / 1e3, THRESHOLDS.first_message_s)
            if not self._changed.wait_for(self._is_free, wait_s):
                return _FAILURE
            self.holds_lock = True
            return _SUCCESS

    def _is_free(self) -> bool:
        """Whether no other session holds the lock."""
        return not any(one.holds_lock for one in self._sessions.values() if one is not self)

    def _wait_for_lock(self) -> None:
        """Wait while another session holds the lock; raises `OSError` where the client leaves."""
        while not self._is_free_now():
            with contextlib.suppress(TimeoutError):
                self._first.wait(THRESHOLDS.tick_s, self._cleared)

    def _is_free_now(self) -> bool:
        with self._changed:
            return self._is_free()
