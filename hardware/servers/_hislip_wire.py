"""Messages of HiSLIP 1.0 (IVI-6.1): a header of 16 bytes, and a payload."""

import enum
import struct
from typing import NamedTuple

_HEADER = struct.Struct("!2sBBIQ")
SIZE = _HEADER.size
MOST = 1 << 20  # bytes of a message, header included
VERSION = 0x0100  # 1.0


class Kind(enum.IntEnum):
    """Types of messages; those with `ASYNC` travel on the second channel."""

    INITIALIZE = 0
    INITIALIZE_RESPONSE = 1
    FATAL_ERROR = 2
    ERROR = 3
    ASYNC_LOCK = 4
    ASYNC_LOCK_RESPONSE = 5
    DATA = 6
    DATA_END = 7
    CLEAR_COMPLETE = 8
    CLEAR_ACKNOWLEDGE = 9
    ASYNC_REMOTE_LOCAL = 10
    ASYNC_REMOTE_LOCAL_RESPONSE = 11
    TRIGGER = 12
    ASYNC_MAXIMUM = 15
    ASYNC_MAXIMUM_RESPONSE = 16
    ASYNC_INITIALIZE = 17
    ASYNC_INITIALIZE_RESPONSE = 18
    ASYNC_CLEAR = 19
    ASYNC_STATUS = 21
    ASYNC_STATUS_RESPONSE = 22
    ASYNC_CLEAR_ACKNOWLEDGE = 23
    ASYNC_LOCK_INFO = 24
    ASYNC_LOCK_INFO_RESPONSE = 25


class Malformed(ConnectionError):
    """Bytes that are no message of this protocol."""


class Header(NamedTuple):
    """What stands before a payload of `length` bytes."""

    kind: int
    control: int
    parameter: int
    length: int

    @classmethod
    def of(cls, data: bytes) -> "Header":
        """Read; raises `Malformed`."""
        mark, kind, control, parameter, length = _HEADER.unpack(data)
        if mark != b"HS" or length > MOST:
            raise Malformed(f"no header of HiSLIP, or {length} bytes in one message")
        return cls(kind, control, parameter, length)


def message(kind: Kind, control: int = 0, parameter: int = 0, payload: bytes = b"") -> bytes:
    """A whole message."""
    return _HEADER.pack(b"HS", kind, control, parameter, len(payload)) + payload
