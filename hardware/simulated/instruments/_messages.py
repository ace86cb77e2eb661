"""Parsing of SCPI program messages: a stream of bytes into messages, units and headers."""

import functools
import re
from collections.abc import Iterator
from typing import NamedTuple

from hardware.servers._instrument import AbstractSplitter

_MOST = 1 << 20  # bytes of one message
_HEADER = re.compile(rb"\s*([*:\w]+\??)\s*(.*)", re.DOTALL)


class Unit(NamedTuple):
    """One command or query of a message: header in upper case, parameters, block."""

    header: str
    parameters: tuple[str, ...]
    block: bytes | None


class TooLong(ValueError):
    """A message that does not end."""


class Messages:
    """Cuts a stream into messages at newlines, but not within blocks."""

    def __init__(self) -> None:
        self._buffer = bytearray()
        self._from = 0  # what is before this was looked at

    def clear(self) -> None:
        """Forget a message that is not complete."""
        self._buffer.clear()
        self._from = 0

    def feed(self, data: bytes) -> Iterator[bytes]:
        """Complete messages, without their newlines. Raises `TooLong`."""
        self._buffer += data
        while (end := self._end()) is not None:
            message = bytes(self._buffer[:end])
            del self._buffer[: end + 1]
            self._from = 0
            yield message
        if len(self._buffer) > _MOST:
            self.clear()
            raise TooLong

    def _end(self) -> int | None:
        buffer = self._buffer
        while self._from < len(buffer):
            newline = buffer.find(b"\n", self._from)
            mark = buffer.find(b"#", self._from, newline if newline >= 0 else len(buffer))
            if mark < 0:
                if newline < 0:
                    self._from = len(buffer)
                    return None
                return newline
            after = self._block_end(mark)
            if after is None:
                self._from = mark
                return None
            self._from = after
        return None

    def _block_end(self, mark: int) -> int | None:
        """Place after the block at `mark`; the next one where it is none; `None`: not there yet.

        That it is none is told by its first byte that is no digit, and so within its own message:
        what is a message does not depend on what comes after it.
        """
        buffer = self._buffer
        if len(buffer) < mark + 2:
            return None
        digits = buffer[mark + 1] - ord("0")
        if not 1 <= digits <= 9:
            return mark + 1
        length = bytes(buffer[mark + 2 : mark + 2 + digits])
        if length and not length.isdigit():
            return mark + 1
        if len(length) < digits:
            return None
        if int(length) > _MOST:
            return mark + 1
        after = mark + 2 + digits + int(length)
        return after if len(buffer) >= after else None


class MessageSplitter(AbstractSplitter):
    """Cuts a client's bytes into program messages, each with its newline."""

    def __init__(self) -> None:
        self._messages = Messages()

    def split(self, data: bytes) -> Iterator[bytes]:
        """Complete messages; of one that does not end, as much as the instrument will refuse."""
        try:
            for message in self._messages.feed(data):
                yield message + b"\n"
        except TooLong:
            yield bytes(_MOST + 1)


def units(message: bytes) -> Iterator[Unit | None]:
    """The units of a message, in order; `None` for one that cannot be read."""
    rest = message
    while rest.strip():
        found = _HEADER.match(rest)
        if not found or found[2][:1] in (b"?", b"#"):
            yield None
            return
        header, rest = found[1].decode("ascii", "replace").upper(), found[2]
        block, head = None, rest
        mark, semicolon = rest.find(b"#"), rest.find(b";")
        if mark >= 0 and (semicolon < 0 or mark < semicolon):
            digits = rest[mark + 1 : mark + 2]
            if not digits.isdigit() or digits == b"0":
                yield None
                return
            start = mark + 2 + int(digits)
            size = rest[mark + 2 : start]
            if not size.isdigit() or len(rest) < start + int(size):
                yield None
                return
            block = rest[start : start + int(size)]
            head, rest = rest[:mark].rstrip().removesuffix(b","), rest[start + int(size) :]
            if rest.strip() and not rest.strip().startswith(b";"):
                yield None
                return
            rest = rest.strip().removeprefix(b";")
        else:
            head, _, rest = rest.partition(b";")
        text = head.decode("ascii", "replace").strip()
        yield Unit(header, tuple(p.strip() for p in text.split(",")) if text else (), block)


@functools.cache
def header_pattern(spec: str) -> re.Pattern[str]:
    """What a header such as `SOURce{n}:VOLTage[:LEVel]:HIGH` looks like: long, short, upper case.

    `{n}` is a channel, 1 where it is left out.
    """
    out = ""
    for part in re.split(r"(\[|\]|:|\{n\}|\?)", spec):
        if part == "{n}":
            out += r"(?P<n>\d?)"
        elif part in "[]":
            out += {"[": "(?:", "]": ")?", "": ""}[part]
        elif part in ":?":
            out += re.escape(part)
        else:
            short = re.match(r"[*A-Z]+", part)
            one, many = re.escape(short[0] if short else part), re.escape(part.upper())
            out += f"(?:{many}|{one})"
    return re.compile(f":?{out}")
