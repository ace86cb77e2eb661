"""Clients that send noise to a server of an instrument, beside one that has work to do."""

import random
import socket
import threading
import time

from hardware.servers._hislip_wire import Kind, message

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


def send_noise(address: tuple[str, int], seed: int, count: int, ended: list[int]) -> None:
    """Send `count` random messages, connecting anew after 50 or where the server hung up.

    What comes back is dropped now and then. The number sent is appended to `ended`.
    """
    rng = random.Random(seed)
    sent = 0
    while sent < count:
        try:
            with socket.create_connection(address, timeout=5.0) as client:
                client.settimeout(0.5)
                for _ in range(min(50, count - sent)):
                    sent += 1
                    client.sendall(random_message(rng))
                    if rng.random() < 0.2:
                        client.setblocking(False)
                        _drop(client)
                        client.settimeout(0.5)
        except OSError:
            continue  # it hung up, as it may
    ended.append(sent)


def _drop(client: socket.socket) -> None:
    try:
        client.recv(1 << 16)
    except BlockingIOError:
        pass


def slowest_beside_noise(ask, address: tuple[str, int], *, clients: int, messages: int) -> float:
    """The longest time of `ask`, s, called over and over while clients send `messages` each.

    Raises `AssertionError` where a client could not send all of them.
    """
    ended: list[int] = []
    threads = [
        threading.Thread(target=send_noise, args=(address, seed, messages, ended))
        for seed in range(clients)
    ]
    for thread in threads:
        thread.start()
    slowest = 0.0
    while any(thread.is_alive() for thread in threads):
        began = time.monotonic()
        ask()
        slowest = max(slowest, time.monotonic() - began)
    assert ended == [messages] * clients, ended
    return slowest
