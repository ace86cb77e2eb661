"""An instrument behind HiSLIP, for `TCPIP::<address>::hislip0,<port>::INSTR`."""

import itertools
import socket
import threading

from . import _hislip_wire as wire
from ._channel import Channel
from ._hislip_wire import Kind, message
from ._instrument import AbstractInstrument
from ._listener import LOOPBACK, AbstractListener
from ._session import Session
from ._shared import SharedInstrument
from ._thresholds import THRESHOLDS

_TOO_MANY, _INVALID_INITIALIZATION = 4, 3  # codes of a fatal error


class HislipServer(AbstractListener):
    """Serves each client's session in threads of its own, by default to this computer alone.

    Synchronized mode of HiSLIP 1.0, with exclusive locks and without service requests. Each answer
    says which message it is to, so that a late one is never taken for the next. A context manager.

    >>> from hardware import HislipServer
    >>> from hardware.simulated import SimulatedAFG31052
    >>> with HislipServer(SimulatedAFG31052()) as server:  # `VisaLink(server.resource)` reaches it
    ...     server.resource.startswith("TCPIP::127.0.0.1::hislip0,")
    True
    """

    def __init__(
        self,
        instrument: AbstractInstrument,
        port: int = 0,
        *,
        host: str = LOOPBACK,
        alone: bool = False,
    ) -> None:
        """`port`: 0 for any that is free; `host`: the address to listen at.

        `alone`: one client at a time; another is refused while one is served.
        """
        self._instrument = SharedInstrument(instrument)
        self._numbers = itertools.cycle(range(1, 1 << 16))
        self._sessions: dict[int, Session] = {}
        self._changed = threading.Condition()  # sessions, and who holds the lock
        self._alone = alone
        super().__init__(port, host=host)

    @property
    def resource(self) -> str:
        """Its VISA address."""
        return f"TCPIP::{self.host}::hislip0,{self.port}::INSTR"

    def _serve_client(self, connection: socket.socket) -> None:
        """A connection is the first channel of a new session, or the second of one."""
        channel = Channel(connection, self._stop)
        header, _ = channel.next(within_s=THRESHOLDS.first_message_s)
        if header.kind == Kind.INITIALIZE:
            self._serve_first(channel)
            return
        session = self._sessions.get(header.parameter)
        if header.kind == Kind.ASYNC_INITIALIZE and session is not None and session.join(channel):
            channel.send(message(Kind.ASYNC_INITIALIZE_RESPONSE))
            session.ready.set()
            session.serve_second()
        else:
            channel.send(message(Kind.FATAL_ERROR, _INVALID_INITIALIZATION))

    def _serve_first(self, channel: Channel) -> None:
        session = self._begin(channel)
        if session is None:
            channel.send(message(Kind.FATAL_ERROR, _TOO_MANY))
            return
        try:
            channel.send(message(Kind.INITIALIZE_RESPONSE, 0, wire.VERSION << 16 | session.number))
            if session.wait_for_second(self._stop):
                self._instrument.connected()
                session.serve_first()
        finally:
            session.close()
            with self._changed:
                del self._sessions[session.number]
                self._changed.notify_all()

    def _begin(self, channel: Channel) -> Session | None:
        """A new session; `None` where one is served alone and does not end."""
        with self._changed:
            if self._alone and not self._changed.wait_for(
                lambda: not self._sessions, THRESHOLDS.handover_s
            ):
                return None
            number = next(one for one in self._numbers if one not in self._sessions)
            found = Session(number, channel, self._instrument, self._sessions, self._changed)
            self._sessions[number] = found
            return found
