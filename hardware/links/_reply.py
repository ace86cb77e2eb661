"""Strict parsing of replies: lines, numbers, error entries, blocks."""

import math
import re
from collections.abc import Callable

from hardware._errors import LinkError

from ._link import Received
from ._thresholds import THRESHOLDS

INFINITE = 9.9e37  # what SCPI writes for infinity; 9.91E37 is "not a number"
_NUMBER = re.compile(r"[+-]?(\d{1,30}(\.\d{0,30})?|\.\d{1,30})([eE][+-]?\d{1,3})?")
_ENTRY = re.compile(r'([+-]?\d{1,6}),\s*"(.*)"')
_NOT_SCPI = "The other side does not speak SCPI, or two programs use the instrument at once."
_LOOK = "Check the address; then connect again."

Receive = Callable[[int], Received]  # at most so many bytes


def malformed(why: str, received: bytes) -> LinkError:
    """An answer that cannot be one."""
    return LinkError(f"{why} {_NOT_SCPI}", _LOOK, received)


def read_line(receive: Receive, *, limit: int | None = None) -> str:
    """One line of printable ASCII without its end, with nothing behind it; `limit`: most bytes."""
    limit = THRESHOLDS.line_bytes if limit is None else limit
    got = bytearray()
    while b"\n" not in got:
        if len(got) > limit:
            raise malformed(f"The answer has more than {limit} bytes.", bytes(got))
        data, end = receive(limit + 2 - len(got))
        got += data
        if end:
            break
    line, _, rest = bytes(got).partition(b"\n")
    if rest:
        raise malformed("There is more than one answer.", bytes(got))
    line = line.removesuffix(b"\r")
    if not line or any(not 32 <= byte <= 126 for byte in line) or len(line) > limit:
        raise malformed("The answer is empty, too long or not printable text.", bytes(got))
    return line.decode("ascii")


def read_block(receive: Receive, *, limit: int, size: int | None = None) -> bytes:
    """The content of one IEEE 488.2 definite-length block, `#<n><n digits><bytes>` and a newline.

    `limit`: most bytes; `size`: how many they must be, where that is known.
    """
    head, end = _exactly(receive, 2)
    if end or head[:1] != b"#" or not b"1" <= head[1:2] <= b"9":
        raise malformed("The answer is no block of definite length.", head)
    digits, end = _exactly(receive, int(head[1:2]))
    if end or not (digits.isdigit() and digits.isascii()):
        raise malformed("The block's length is not a number.", head + digits)
    length = int(digits)
    if length > limit or (size is not None and length != size):
        asked = f"at most {limit}" if size is None else str(size)
        raise malformed(f"The block has {length} bytes, but must have {asked}.", head + digits)
    content, end = _exactly(receive, length)
    if not end:
        tail, end = _exactly(receive, 1)
        if tail == b"\r" and not end:
            tail, end = _exactly(receive, 1)
        if tail != b"\n":
            raise malformed("The block goes on beyond its stated length.", head + digits + tail)
    return content


def _exactly(receive: Receive, count: int) -> tuple[bytes, bool]:
    got, end = bytearray(), False
    while len(got) < count:
        if end:
            raise malformed(f"The block ends {count - len(got)} byte(s) early.", bytes(got[:64]))
        data, end = receive(count - len(got))
        got += data
    return bytes(got), end


def number(line: str) -> float:
    """A finite number, or infinity where SCPI says so; `ValueError` for anything else."""
    if not _NUMBER.fullmatch(line):
        raise ValueError("it is not a number")
    value = float(line)
    if math.isclose(abs(value), INFINITE, rel_tol=THRESHOLDS.infinity_tolerance):
        return math.copysign(math.inf, value)
    if not abs(value) < INFINITE:
        raise ValueError("it is not a finite number")
    return value


def error_entry(line: str) -> tuple[int, str]:
    """An entry of the error queue, number and text; `ValueError` for anything else."""
    found = _ENTRY.fullmatch(line)
    if not found:
        raise ValueError('it is not an entry such as 0,"No error"')
    return int(found[1]), found[2]
