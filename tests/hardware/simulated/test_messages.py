"""Messages out of a stream of bytes: what one is does not depend on what comes after it."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hardware.servers._shared import SharedInstrument
from hardware.simulated import SimulatedAFG31052
from hardware.simulated.instruments._messages import Messages, MessageSplitter

STREAMS = st.lists(st.sampled_from([*(bytes([c]) for c in b"#0123459\n;, "), b"DATA", b"*IDN?\n"]))
PARTS = st.lists(st.integers(1, 9), min_size=1)


def split(data: bytes, parts: list[int]) -> list[bytes]:
    """The messages of a stream that comes in pieces of so many bytes, over and over."""
    splitter, found, at, k = MessageSplitter(), [], 0, 0
    while at < len(data):
        size = parts[k % len(parts)]
        found += splitter.split(data[at : at + size])
        at, k = at + size, k + 1
    return found


@given(STREAMS, PARTS)
@example([b"A#9\n", b"*IDN?\n"], [4])
def test_a_message_is_the_same_however_its_bytes_come(parts, sizes):
    data = b"".join(parts)
    assert split(data, sizes) == list(MessageSplitter().split(data))


@given(STREAMS)
@example([b"A#9\n", b"*IDN?\n", b"*IDN?\n"])
def test_a_message_of_one_client_leaves_nothing_to_wait_for(parts):
    """What is given to the instrument whole is whole for it, too: the next is another client's."""
    for message in MessageSplitter().split(b"".join(parts)):
        alone = Messages()
        assert [one + b"\n" for one in alone.feed(message)] == [message]
        assert list(alone.feed(b"*IDN?\n")) == [b"*IDN?"]


@pytest.mark.fault(
    name="a block that a client only announces", promise="another client's query is answered to it"
)
@pytest.mark.parametrize(
    "noise", [b"A#9\n;;;;;;;;;\n", b"DATA:DATA EMEM1,#8\n12345678\n", b"#91\n;;;;;;;\n"]
)
def test_a_block_that_is_only_announced_takes_no_answer_of_another_client(noise):
    shared = SharedInstrument(SimulatedAFG31052())
    for message in MessageSplitter().split(noise):
        list(shared.feed(message))
        (answer,) = shared.feed(b"*IDN?\n")
        assert b"AFG31052" in answer.data
