"""Damage to the bytes of a file, as disks, networks, editors and attackers do it."""

import os
import random
from collections.abc import Callable

# Of each kind of file; the short tier tries a few. Set it for a longer search.
TRIALS = int(os.environ.get("RAPI_MUTATIONS", "0"))
WORDS = (
    b"nan", b"inf", b"-1e308", b"1e999", b"9" * 5000, b"true", b'"7.5"', b"\0", b"\xff\xfe",
    b"[" * 5000, b"a" + b".a" * 200, b"\x1b[2J", b"../../x", b"\r\n", b",", b"=", b"{", b"#999999",
    b"-0", b"1e12",
)  # fmt: skip


def trials(few: int) -> int:
    """How many to try: `few`, or what the environment variable `RAPI_MUTATIONS` says."""
    return TRIALS or few


def mutated(content: bytes, rng: random.Random) -> bytes:
    """`content` with one to four changes."""
    data = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        rng.choice(_CHANGES)(data, rng)
    return bytes(data)


def _cut(data: bytearray, rng: random.Random) -> None:
    del data[rng.randint(0, len(data)) :]


def _remove(data: bytearray, rng: random.Random) -> None:
    at = rng.randint(0, len(data))
    del data[at : at + rng.choice((1, 7, 100))]


def _flip(data: bytearray, rng: random.Random) -> None:
    if data:
        data[rng.randrange(len(data))] ^= 1 << rng.randrange(8)


def _insert(data: bytearray, rng: random.Random) -> None:
    at = rng.randint(0, len(data))
    data[at:at] = rng.choice(WORDS)


def _replace_number(data: bytearray, rng: random.Random) -> None:
    places = [i for i, byte in enumerate(data) if 48 <= byte <= 57]
    if places:
        at = rng.choice(places)
        data[at : at + 1] = rng.choice(WORDS)


def _repeat(data: bytearray, rng: random.Random) -> None:
    at = rng.randint(0, len(data))
    data[at:at] = data[at : at + rng.choice((1, 50, 2000))]


def _move_line(data: bytearray, rng: random.Random) -> None:
    lines = bytes(data).split(b"\n")
    rng.shuffle(lines)
    data[:] = b"\n".join(lines)


_CHANGES: tuple[Callable[[bytearray, random.Random], None], ...] = (
    _cut, _remove, _flip, _flip, _insert, _replace_number, _replace_number, _repeat, _move_line,
)  # fmt: skip
