"""Peers with generated replies, right, spoilt or hostile, and a judge of what may be returned."""

import numpy as np

from hardware import InstrumentError, Scpi
from hardware.simulated import AbstractInstrument, Answer, SimulatedLink

TIMEOUT_S = 1.0
NOISE = (
    b"",
    b"\n",
    b"\x00" * 40 + b"\n",
    b"\x1b[2J\x1b]0;owned\x07\n",
    b"A" * 5000 + b"\n",
    b"A" * 5000,
    b"nan\n",
    b"inf\n",
    b"-9.91E37\n",
    b"1e999\n",
    b"1_000\n",
    b"0x10\n",
    b"1.0;2.0\n",
    b"1\n2\n",
    b"\xff\xfe1\n",
    b"#\n",
    b"#0\x01\x02\n",
    b"#1\n",
    b"#6-00008\n",
    b"#6 00008\n",
    b"#9999999999",
    b"#6999999" + b"\x00" * 64,
)


class Scripted(AbstractInstrument):
    """Gives prepared answers, whatever it is fed; a new connection has none but the identity."""

    def __init__(self, answers):
        self.answers = answers

    def connected(self) -> None:
        pass

    def feed(self, data: bytes):
        answers, self.answers = self.answers, ()
        return answers


def repeated(answer):
    """For ever the same."""
    while True:
        yield answer


def spoilt(rng, right):
    """Answers to one query, and whether they are the right one, in time."""
    kind = int(rng.integers(14))
    late = TIMEOUT_S * float(rng.uniform(1.01, 5.0))
    cut = int(rng.integers(len(right)))
    if kind <= 2:
        return [Answer(right)], True
    if kind == 3:  # in pieces, slowly, but in time
        size = int(rng.integers(1, len(right) + 1))
        pieces = [right[i : i + size] for i in range(0, len(right), size)]
        wait = 0.9 * TIMEOUT_S / len(pieces)
        return [Answer(piece, wait) for piece in pieces], True
    if kind == 4:  # in pieces, too slowly as a whole
        wait = 1.2 * TIMEOUT_S / len(right)
        return [Answer(right[i : i + 1], wait) for i in range(len(right))], False
    if kind == 5:
        return [Answer(right, late)], False
    if kind == 6:
        return [Answer(right[:cut])], False
    if kind == 7:
        return [Answer(right[:cut], hang_up=True)], False
    if kind == 8:
        return [Answer(right[:cut], deaf=True)], False
    if kind == 9:  # bytes too many
        return [Answer(right + bytes(rng.integers(1, 256, 3, dtype=np.uint8)))], None
    if kind == 10:
        return [Answer(NOISE[int(rng.integers(len(NOISE)))])], False
    if kind == 11:
        return [Answer(bytes(rng.integers(0, 256, int(rng.integers(1, 200)), np.uint8)))], False
    if kind == 12:  # one byte of the framing is another
        changed = bytearray(right)
        is_block = right[:1] == b"#"
        at = int(rng.integers(2 + int(right[1:2]))) if is_block else len(right) - 1
        changed[at] ^= int(rng.integers(1, 256))
        return [Answer(bytes(changed))], None
    piece = bytes(rng.integers(0, 256, 512, np.uint8)) if cut % 2 else b"9" * 512
    return repeated(Answer(piece, float(rng.choice([0.0, 1e-3, 0.3])))), False


def try_one(rng):
    """One query of one kind, held to every promise; gives what came of it."""
    kind = ("text", "number", "block", "free block", "command")[int(rng.integers(5))]
    value = float(f"{rng.normal() * 10.0 ** rng.integers(-9, 9):.6E}")
    content = bytes(rng.integers(0, 256, int(rng.integers(1, 300)), np.uint8))
    size = str(len(content)).encode()
    right = {
        "text": b"MAKER,MODEL,1,FV:2\r\n",
        "number": f"{value:.6E}\n".encode(),
        "block": b"#" + str(len(size)).encode() + size + content + b"\n",
        "command": b"1\n",
    }
    right["free block"] = right["block"]
    answers, good = spoilt(rng, right[kind])
    link = SimulatedLink(Scripted(answers), per_byte_s=1e-6, ends=bool(rng.integers(2)))
    session = Scpi(link, timeout_s=TIMEOUT_S)
    try:
        if kind == "text":
            assert session.text("*IDN?", r"MAKER,MODEL,\d,FV:\d") == "MAKER,MODEL,1,FV:2"
        elif kind == "number":
            assert session.number("SOUR1:FREQ?") == value
        elif kind == "block":
            assert session.block("DATA:DATA?", limit=4096, size=len(content)) == content
        elif kind == "free block":
            got = session.block("DATA:DATA?", limit=4096)
            assert got == content or good is not True and len(got) <= 4096
            if good is False:
                raise AssertionError(f"an array out of {answers}")
        else:
            session.command("SOUR1:FREQ 20")
            raise AssertionError("nothing answered the error queue")
    except InstrumentError as error:
        outcome = "refused"
        assert good is not True or kind == "command", (kind, answers, error)
        text = str(error)
        assert text.isprintable()
        assert len(text) < 1000
        assert error.resource == "SIM::INSTR"
        assert error.command
    else:
        outcome = "taken"
    assert link.clock_s <= 2 * TIMEOUT_S
    assert len(link._inbox) <= 1 << 17
    return outcome
