"""Instruments behind VISA: the one place that imports pyvisa."""

import contextlib
import select
import socket
import threading
import time
from collections.abc import Iterator
from typing import Any

from hardware._errors import InstrumentError, LinkError, disconnected, timed_out
from rapi_jax.internal import install_extra
from rapi_jax.io import printable

from ._link import AbstractLink, Received
from ._thresholds import THRESHOLDS

# Bytes that pyvisa-py moves at once. Asked for more, it keeps what it read too much where it
# cannot be seen from here.
_CHUNK = 4096


class VisaLink(AbstractLink):
    """A VISA resource, such as `TCPIP::192.168.0.7::INSTR` or `TCPIP::192.168.0.7::5025::SOCKET`.

    A raw socket of pyvisa-py opens where nothing listens, waits for ever on a peer that does not
    read, and gathers an endless answer without bound. So the socket is watched here, and pyvisa
    moves only what there is, or is room for. Its HiSLIP counts a deadline anew for every piece of a
    message, so such a connection is shut when time is up.

    >>> from hardware import Scpi, TcpServer, VisaLink
    >>> from hardware.simulated import SimulatedAFG31052
    >>> with TcpServer(SimulatedAFG31052()) as server:  # or an instrument in the laboratory
    ...     link = VisaLink(server.resource, backend="@py")  # needs the extra `lab`
    ...     identity = Scpi(link).text("*IDN?")
    ...     link.close()
    >>> identity.split(",")[1]
    'AFG31052'
    """

    def __init__(self, resource: str, *, backend: str = "", open_s: float = 5.0) -> None:
        """`backend`: as `pyvisa.ResourceManager` takes it, "@py" for pyvisa-py; `open_s`: longest
        time to connect, s. Raises `InstrumentError`.
        """
        self.resource = resource
        self._backend = backend
        self._visa: Any = None
        self._socket: socket.socket | None = None  # of a raw connection
        self._sync: socket.socket | None = None  # of HiSLIP
        try:
            self._open(open_s)
        except LinkError as error:
            raise InstrumentError(
                resource, "(connect)", error.received, why=error.why, cure=error.cure
            ) from error

    def now(self) -> float:
        """Seconds of the computer's steady clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(max(seconds, 0.0))

    def send(self, data: bytes, deadline: float) -> None:
        """Send all of `data`; where the other side stops reading, only until the deadline."""
        began = self.now()
        with self._failing(deadline - began):
            if self._socket is None:
                self._visa.timeout = self._left(deadline, began) * 1e3
                written = self._visa.write_raw(data)
                if written != len(data):
                    raise disconnected()
                return
            for at in range(0, len(data), _CHUNK):
                left = self._left(deadline, began)
                if not select.select([], [self._socket], [], left)[1]:
                    raise timed_out(deadline - began)
                self._socket.settimeout(left)
                self._visa.write_raw(data[at : at + _CHUNK])

    def receive(self, count: int, deadline: float) -> Received:
        """The next 1 to `count` bytes; a raw socket never says where a message ends."""
        began = self.now()
        with self._failing(deadline - began):
            left = self._left(deadline, began)
            if self._socket is None:
                return self._message(min(count, THRESHOLDS.message_bytes), left)
            if not select.select([self._socket], [], [], left)[0]:
                raise timed_out(deadline - began)
            there = len(self._socket.recv(min(count, _CHUNK), socket.MSG_PEEK))
            if there == 0:
                raise disconnected()
            return Received(self._visa.read_bytes(there, chunk_size=there), False)

    def unread(self) -> bytes:
        """What has come on a raw socket; for other resources nothing is known without asking."""
        if self._socket is None:
            return b""
        with self._failing(0.0):
            if not select.select([self._socket], [], [], 0.0)[0]:
                return b""
            there = self._socket.recv(_CHUNK, socket.MSG_PEEK)
            if not there:
                raise disconnected()
            return there

    def reconnect(self, deadline: float) -> None:
        """Close and open again; then clear the instrument's buffers where VISA can."""
        self.close()
        self._open(max(deadline - self.now(), THRESHOLDS.reconnect_s))
        if self._socket is None:
            with self._failing(deadline - self.now()):
                self._visa.clear()

    def close(self) -> None:
        """Close the resource."""
        visa, self._visa, self._socket, self._sync = self._visa, None, None, None
        if visa is not None:
            import pyvisa

            with contextlib.suppress(pyvisa.Error, OSError):
                visa.close()

    def _open(self, seconds: float) -> None:
        try:
            import pyvisa
        except ImportError:
            raise LinkError("pyvisa is not installed here.", install_extra("lab")) from None
        try:
            manager = pyvisa.ResourceManager(self._backend)
            self._visa = manager.open_resource(self.resource, open_timeout=int(seconds * 1e3))
            self._visa.timeout = seconds * 1e3
            session = getattr(manager.visalib, "sessions", {}).get(self._visa.session)
            interface = getattr(session, "interface", None)
            if isinstance(interface, socket.socket):
                interface.getpeername()  # raises where nothing listens
                interface.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._socket = interface
            else:
                self._sync = getattr(interface, "_sync", None)
                self._lock(seconds)
        except LinkError:
            self.close()
            raise
        except Exception as error:  # pyvisa-py raises bare exceptions where it cannot connect
            self.close()
            raise LinkError(
                f"It cannot be opened ({_cause(error)}).",
                "Check the address, that the instrument is on, and that a VISA library is there "
                "(NI-VISA, or pyvisa-py with backend '@py').",
            ) from error

    def _lock(self, seconds: float) -> None:
        """Take the VISA lock, where library and instrument have one, for as long as this is open.

        Raises `LinkError` where another program holds it.
        """
        import pyvisa
        from pyvisa.constants import StatusCode

        try:
            self._visa.lock_excl(timeout=int(seconds * 1e3))
        except pyvisa.VisaIOError as error:
            if error.error_code in (StatusCode.error_resource_locked, StatusCode.error_timeout):
                raise LinkError(
                    "Another program holds the VISA lock of this instrument.",
                    "End that program first: two would change each other's settings.",
                ) from error
        except (NotImplementedError, AttributeError):
            return  # this library has none

    def _message(self, count: int, left: float) -> Received:
        from pyvisa.constants import StatusCode

        more, gone = StatusCode.success_max_count_read, StatusCode.success_device_not_present
        self._visa.timeout = left * 1e3
        with self._visa.ignore_warning(more, gone), _shut_after(left, self._sync):
            data, status = self._visa.visalib.read(self._visa.session, count)
        return Received(bytes(data), status != more)

    def _left(self, deadline: float, began: float) -> float:
        left = deadline - self.now()
        if left <= 0:
            raise timed_out(deadline - began)
        return left

    @contextlib.contextmanager
    def _failing(self, seconds: float) -> Iterator[None]:
        import pyvisa
        from pyvisa.constants import StatusCode

        if self._visa is None:
            raise disconnected()
        try:
            yield
        except LinkError:
            raise
        except TimeoutError as error:
            raise timed_out(seconds) from error
        except pyvisa.VisaIOError as error:
            if error.error_code == StatusCode.error_timeout:
                raise timed_out(seconds) from error
            raise LinkError(
                f"VISA reports: {_cause(error)}.", "Check the cable, and connect again."
            ) from error
        # pyvisa-py's HiSLIP: a dropped connection, a header that is none, an answer out of turn.
        except (pyvisa.Error, OSError, ValueError, RuntimeError, AssertionError) as error:
            raise disconnected() from error


@contextlib.contextmanager
def _shut_after(seconds: float, connection: socket.socket | None) -> Iterator[None]:
    """End what waits on `connection` when time is up; `TimeoutError` then."""
    if connection is None:
        yield
        return
    over = threading.Event()

    def shut() -> None:
        over.set()
        with contextlib.suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)

    timer = threading.Timer(seconds, shut)
    timer.start()
    try:
        yield
    except Exception as error:
        if over.is_set():
            raise TimeoutError from error
        raise
    finally:
        timer.cancel()
        timer.join()


def _cause(error: BaseException) -> str:
    return printable(" ".join(str(error).split()).rstrip(".") or type(error).__name__)
