"""Whatever an instrument answers: the right value or one error, in time, in bounded memory."""

import tracemalloc
from collections import Counter

import hypothesis.strategies as st
import numpy as np
import pytest
from generated_replies import NOISE, Scripted, repeated, try_one
from hypothesis import example, given, settings

from hardware import InstrumentError, Scpi
from hardware._errors import LinkError
from hardware.links._link import Received
from hardware.links._reply import read_line
from hardware.simulated import Answer, Faulty, SimulatedAFG31052, SimulatedLink, Slow


@pytest.mark.fault(
    name="generated answers: late, cut, dripping, endless, noise, a lying block header",
    promise="the right value or one error, within twice the deadline, memory bounded",
    trials=4000,
    seed=7,
)
@pytest.mark.slow
def test_a_few_thousand_replies():
    rng = np.random.default_rng(7)
    outcomes = Counter(try_one(rng) for _ in range(4000))
    assert outcomes["taken"] > 800
    assert outcomes["refused"] > 2000


def strict_number(data):
    """What a whole answer means, read another way: `None` where it means nothing."""
    if not data.endswith(b"\n") or data.count(b"\n") != 1:
        return None
    line = data[:-1].removesuffix(b"\r")
    if not line or set(line) - set(b"0123456789+-.eE"):
        return None
    try:
        return float(line)
    except ValueError:
        return None


numbers = st.text("0123456789+-.eE\r\n ", min_size=1, max_size=12).map(str.encode)


@settings(max_examples=400)
@given(numbers | st.binary(max_size=20), st.booleans())
@example(b"1e5\n", False)
@example(b"9.9E+37\n", False)
def test_a_number_is_read_as_written_or_not_at_all(data, newline):
    data += b"\n" if newline else b""
    session = Scpi(SimulatedLink(Scripted([Answer(data)])), timeout_s=1.0)
    try:
        value = session.number("SOUR1:FREQ?")
    except InstrumentError:
        return
    expected = strict_number(data)
    assert expected is not None
    assert value == expected or expected == 9.9e37 and value == np.inf


def test_a_good_number_is_read():
    for data, value in ((b"+1.5E+3\r\n", 1500.0), (b"-.25\n", -0.25), (b"7\n", 7.0)):
        session = Scpi(SimulatedLink(Scripted([Answer(data)])))
        assert session.number("SOUR1:FREQ?") == value


@pytest.mark.parametrize("reply", [b"9.91E37\n", b"-9.91E+37\n", b"1E38\n", b"1E+999\n"])
def test_what_scpi_writes_for_no_number_is_none(reply):
    with pytest.raises(InstrumentError, match="not a finite number"):
        Scpi(SimulatedLink(Scripted([Answer(reply)]))).number("SOUR1:FREQ?")


@pytest.mark.parametrize(("reply", "value"), [(b"9.9E37\n", np.inf), (b"-9.9E+37\n", -np.inf)])
def test_infinity_has_its_sign(reply, value):
    assert Scpi(SimulatedLink(Scripted([Answer(reply)]))).number("OUTP1:IMP?") == value


def blocks(header, content):
    return SimulatedLink(Scripted([Answer(header + content)]))


@pytest.mark.fault(name="a block whose header lies", promise="no array")
@pytest.mark.parametrize(
    ("header", "content"),
    [
        (b"#18", b"\x00" * 6 + b"\n"),  # too short: never padded
        (b"#14", b"\x00" * 8 + b"\n"),  # too long: never cut
        (b"#16", b"\x00" * 6),  # no newline: the message may go on
        (b"#0", b"\x00" * 8 + b"\n"),
        (b"#:", b"\x00" * 8 + b"\n"),
        (b"8", b"\x00" * 8 + b"\n"),
        (b"#9000000008", b"\x00" * 7),
        (b"#2\xb2\xb3", b"\x00" * 23 + b"\n"),  # digits elsewhere, but not here
    ],
)
def test_a_lying_block_gives_no_array(header, content):
    with pytest.raises(InstrumentError):
        Scpi(blocks(header, content)).block("DATA:DATA? EMEM1", limit=64)


@pytest.mark.parametrize(("limit", "size"), [(64, 6), (64, 10), (7, None)])
def test_a_block_of_another_size_gives_no_array(limit, size):
    with pytest.raises(InstrumentError, match="has 8 bytes, but must have"):
        Scpi(blocks(b"#18", b"\x00" * 8 + b"\n")).block("DATA?", limit=limit, size=size)


def test_a_block_may_hold_newlines():
    content = b"\n\n#18;\n\n"
    session = Scpi(blocks(b"#18", content + b"\n"))
    assert session.block("DATA:DATA? EMEM1", limit=64, size=8) == content


@pytest.mark.fault(name="an endless answer", promise="one error in time, memory bounded")
@pytest.mark.parametrize("piece", [b"7" * 512, b"#6262144" + b"\x00" * 512, b"\n" * 512])
@pytest.mark.parametrize("seconds", [0.0, 1e-4])
def test_an_endless_answer_takes_no_memory(piece, seconds):
    link = SimulatedLink(Scripted(repeated(Answer(piece, seconds))), per_byte_s=1e-9)
    session = Scpi(link, timeout_s=1.0)
    tracemalloc.start()
    with pytest.raises(InstrumentError):
        session.text("*IDN?")
    with pytest.raises(InstrumentError):
        session.block("DATA:DATA? EMEM1", limit=262_144)
    assert tracemalloc.get_traced_memory()[1] < 4e6
    tracemalloc.stop()
    assert link.clock_s <= 2.0


def test_a_line_without_end_is_refused_at_its_limit():
    def receive(count):
        assert count > 0  # else it would be asked for ever
        return Received(b"7" * count, end=False)

    with pytest.raises(LinkError, match="more than 10 bytes"):
        read_line(receive, limit=10)


@pytest.mark.fault(name="a late answer", promise="never taken for the next one")
def test_a_late_answer_is_not_the_next_one():
    instrument = Faulty(SimulatedAFG31052(), Slow(1.5), when=b"HIGH?", times=1)
    link = SimulatedLink(instrument)
    session = Scpi(link, timeout_s=1.0)
    session.identify("TEKTRONIX.*")
    session.command("SOUR1:FREQ 20")
    with pytest.raises(InstrumentError, match="no answer within 1 s"):
        session.number("SOUR1:VOLT:HIGH?")  # 0.5, late
    link.sleep(10.0)
    assert session.number("SOUR1:FREQ?") == 20.0
    assert link.connections == 2


@pytest.mark.fault(name="an answer too many", promise="never taken for the next one")
def test_an_answer_too_many_is_not_the_next_one():
    instrument = SimulatedAFG31052()
    link = SimulatedLink(instrument)
    session = Scpi(link, timeout_s=1.0)
    session.identify("TEKTRONIX.*")
    link._queue([Answer(b"12345\n")])  # nobody asked
    with pytest.raises(InstrumentError, match="nobody had asked for"):
        session.number("SOUR1:FREQ?")
    assert session.number("SOUR1:FREQ?") == 1e6


@pytest.mark.fault(name="another instrument answers after connecting again", promise="refused")
def test_after_connecting_again_the_instrument_must_be_the_same():
    instrument = SimulatedAFG31052()
    peer = Faulty(instrument, Slow(9.0), when=b"FREQ?", times=1)
    session = Scpi(SimulatedLink(peer), timeout_s=1.0)
    session.identify("TEKTRONIX.*")
    with pytest.raises(InstrumentError):
        session.number("SOUR1:FREQ?")
    instrument.identity = "TEKTRONIX,AFG31052,C999999,SCPI:99.0 FV:1.6.2"
    with pytest.raises(InstrumentError, match="another instrument answers"):
        session.number("SOUR1:FREQ?")


@pytest.mark.fault(
    name="noise and terminal codes as an answer", promise="shown escaped, on one line"
)
@pytest.mark.parametrize("noise", NOISE)
def test_what_came_back_is_shown_without_harm(noise):
    session = Scpi(SimulatedLink(Scripted([Answer(noise)])), timeout_s=1.0)
    with pytest.raises(InstrumentError) as caught:
        session.text("*IDN?", "MAKER.*")
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 600
    assert caught.value.command == "*IDN?"


@pytest.mark.fault(name="entries in the error queue", promise="one error that tells them all")
def test_the_error_queue_is_told_whole_and_emptied():
    instrument = SimulatedAFG31052()
    session = Scpi(SimulatedLink(instrument))
    session.clear()
    instrument.status.report(-310, "fan")
    with pytest.raises(InstrumentError, match="Undefined header") as caught:
        session.command("SOUR1:FREKWENCY 20")
    assert "fan" in caught.value.reply
    session.command("SOUR1:FREQ 20")
    assert session.number("SOUR1:FREQ?") == 20.0


@pytest.mark.fault(name="an error queue without end", promise="an end after 100")
def test_an_error_queue_without_end():
    class Complaining(Scripted):
        def feed(self, data: bytes):
            replies = {b"*OPC?": b"1\n", b"*ESR?": b"0\n", b"SYST:ERR?": b'-310,"System error"\n'}
            return [Answer(replies[data.strip()])] if data.strip() in replies else []

    with pytest.raises(InstrumentError, match="does not end after 100 entries"):
        Scpi(SimulatedLink(Complaining(()))).command("SOUR1:FREQ 20")


def test_a_slow_instrument_is_waited_for():
    link = SimulatedLink(Faulty(SimulatedAFG31052(), Slow(0.2)))
    session = Scpi(link, timeout_s=1.0)
    session.command("SOUR1:FREQ 20")
    assert link.clock_s == pytest.approx(0.6)


def test_the_deadline_is_for_the_whole_call():
    link = SimulatedLink(Faulty(SimulatedAFG31052(), Slow(0.4)))
    with pytest.raises(InstrumentError, match="no answer"):
        Scpi(link, timeout_s=1.0).command("SOUR1:FREQ 20")
    assert link.clock_s <= 1.001
