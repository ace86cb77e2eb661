"""Clients that send noise to a server of an instrument, beside one that has work to do."""

import contextlib
import random
import socket
import threading
import time

from hardware.servers._hislip_wire import SIZE, Header, Kind, message

LETTERS = b"SOUR1:FREQ?#;, 0123456789\n\r*IDN"


def random_message(rng: random.Random) -> bytes:
    """Noise, near misses of commands, headers of HiSLIP whole and broken, blocks that lie."""
    kind = rng.randrange(6)
    if kind == 0:
        return rng.randbytes(rng.randint(1, 60)) + b"\n"
    if kind == 1:
        return bytes(rng.choices(LETTERS, k=rng.randint(1, 40))) + b"\n"
    if kind == 2:
        return b"HS" + rng.randbytes(14)
    if kind == 3:
        return message(rng.choice(list(Kind)), 0, rng.randint(0, 9), rng.randbytes(9))
    if kind == 4:
        return b"DATA:DATA EMEM1,#6" + rng.randbytes(6) + b"\n"
    return rng.choice((b"*IDN?\n", b"SOURce:VOLTage:PIEZo 50\r\n", b":WAV:DATA?\n", b"TOKEN x\r\n"))


def send_noise(
    address: tuple[str, int], seed: int, count: int, ended: list[int], sessions: bool
) -> None:
    """Send `count` random messages, connecting anew after 50 or where the server hung up.

    What comes back is dropped now and then. `sessions`: every other connection begins as a session
    of HiSLIP, and its noise is the payload of messages. The number sent is appended to `ended`.
    """
    rng = random.Random(seed)
    sent = 0
    while sent < count:
        try:
            with contextlib.ExitStack() as stack:
                client = _dial(address, stack)
                begun = sessions and rng.random() < 0.5
                if begun:
                    _begin_session(address, client, stack)
                for _ in range(min(50, count - sent)):
                    sent += 1
                    noise = random_message(rng)
                    if begun and rng.random() < 0.9:
                        kind = rng.choice((Kind.DATA, Kind.DATA_END, Kind.DATA_END))
                        noise = message(kind, 0, sent, noise)
                    client.sendall(noise)
                    if rng.random() < 0.2:
                        client.setblocking(False)
                        _drop(client)
                        client.settimeout(0.5)
        except OSError:
            continue  # it hung up, as it may
    ended.append(sent)


def _dial(address: tuple[str, int], stack: contextlib.ExitStack) -> socket.socket:
    client = stack.enter_context(socket.create_connection(address, timeout=5.0))
    client.settimeout(0.5)
    return client


def _begin_session(
    address: tuple[str, int], first: socket.socket, stack: contextlib.ExitStack
) -> None:
    """Both channels of a session, as a client of HiSLIP opens them."""
    first.sendall(message(Kind.INITIALIZE, 0, 0x01000000, b"hislip0"))
    number = Header.of(first.recv(SIZE)).parameter & 0xFFFF
    second = _dial(address, stack)
    second.sendall(message(Kind.ASYNC_INITIALIZE, 0, number))
    second.recv(SIZE)


def _drop(client: socket.socket) -> None:
    try:
        client.recv(1 << 16)
    except BlockingIOError:
        pass


def slowest_beside_noise(
    ask, address: tuple[str, int], *, clients: int, messages: int, sessions: bool = False
) -> float:
    """The longest time of `ask`, s, called over and over while clients send `messages` each.

    `sessions`: as in `send_noise`. Raises `AssertionError` where a client could not send all of
    them, or a thread of the server ended by an exception.
    """
    ended: list[int] = []
    raised: list[str] = []
    hook = threading.excepthook
    threading.excepthook = lambda said: raised.append(f"{said.exc_type.__name__}: {said.exc_value}")
    try:
        threads = [
            threading.Thread(target=send_noise, args=(address, seed, messages, ended, sessions))
            for seed in range(clients)
        ]
        for thread in threads:
            thread.start()
        slowest = 0.0
        while any(thread.is_alive() for thread in threads):
            began = time.monotonic()
            ask()
            slowest = max(slowest, time.monotonic() - began)
    finally:
        threading.excepthook = hook
    assert not raised, raised
    assert ended == [messages] * clients, ended
    return slowest
