"""The simulated generator speaks SCPI: long and short forms, blocks cut anywhere, errors."""

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings

from hardware.simulated import SimulatedAFG31052


def say(instrument, *messages):
    """What comes back for messages sent one after the other."""
    sent = b"".join(m if isinstance(m, bytes) else m.encode() + b"\n" for m in messages)
    return (
        b"".join(answer.data for answer in instrument.feed(sent)).decode("latin-1").split("\n")[:-1]
    )


@pytest.mark.parametrize(
    "spelling",
    [
        "SOURce1:VOLTage:LEVel:IMMediate:HIGH",
        "source1:voltage:level:immediate:high",
        "SOUR1:VOLT:LEV:IMM:HIGH",
        ":SOUR1:VOLT:HIGH",
        "SOUR:VOLT:LEVEL:HIGH",
    ],
)
def test_spellings(spelling):
    instrument = SimulatedAFG31052()
    assert say(instrument, f"{spelling} 0.75", f"{spelling}?", "SOUR2:VOLT:HIGH?") == [
        "7.5000E-01",
        "5.0000E-01",
    ]


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("SOUR1:FREKWENCY 20", -113),
        ("SOURC1:FREQ 20", -113),
        ("SOUR3:FREQ 20", -113),
        ("SOUR1:FREQ", -109),
        ("SOUR1:FREQ 1,2", -108),
        ("SOUR1:FREQ twenty", -224),
        ("SOUR1:FREQ 1e12", -222),
        ("OUTP1:IMPINF", -113),  # the space left out, as in a public driver
        ("OUTP1:IMP 0", -222),
        ("OUTP1 MAYBE", -224),
        ("SOUR1:VOLT:HIGH 6", -222),
        ("SOUR1:VOLT:LOW 0.6", -221),
        ("SOUR1:VOLT:LIM:HIGH 0.2", -221),
        ("SOUR1:FUNC:SHAP EMEM3", -224),
        (b"DATA:DATA EMEM1,#16\x00\x00\x00\x01\x3f\xff\n", -222),  # code 16383
        (b"DATA:DATA EMEM1,#12\x00\x00\n", -223),  # one point
        (b"DATA:DATA EMEM1,#15\x00\x00\x00\x00\x00\n", -161),
        (b"DATA:DATA EMEM1,#14\x00\x00\x00\x00junk\n", -102),
        ("DATA:DATA EMEM1", -109),
        ("?", -102),
    ],
)
def test_what_it_refuses_is_in_the_queue_and_in_the_register(message, code):
    instrument = SimulatedAFG31052()
    say(instrument, "*CLS")
    assert say(instrument, message) == []
    assert say(instrument, "*ESR?") == [str({1: 32, 2: 16}[-code // 100])]
    entry, end = say(instrument, "SYST:ERR?", "SYSTem:ERRor:NEXT?")
    assert entry.startswith(f"{code},")
    assert end == '0,"No error"'


def test_the_queue_overflows():
    instrument = SimulatedAFG31052()
    for _ in range(50):
        say(instrument, "NONSENSE")
    entries = [say(instrument, "SYST:ERR?")[0] for _ in range(33)]
    assert entries[31].startswith("-350")
    assert entries[32].startswith("0,")


def test_several_in_one_message():
    instrument = SimulatedAFG31052()
    assert say(instrument, "SOUR1:FREQ 20;:SOUR1:FREQ?;*OPC?") == ["2.0000000000E+01;1"]


codes = st.lists(st.integers(0, 16382), min_size=2, max_size=60)


@settings(max_examples=100)
@given(codes, st.data())
def test_an_upload_may_be_cut_anywhere(values, data):
    content = np.array(values, ">u2").tobytes()
    size = str(len(content)).encode()
    sent = b"SOUR1:FREQ 20\nDATA:DATA EMEM2,#" + str(len(size)).encode() + size + content
    sent += b"\nDATA:POIN? EMEM2\n*OPC?\n"
    instrument, at, got = SimulatedAFG31052(), 0, b""
    while at < len(sent):
        step = data.draw(st.integers(1, len(sent)))
        got += b"".join(answer.data for answer in instrument.feed(sent[at : at + step]))
        at += step
    assert got == str(len(values)).encode() + b"\n1\n"
    back = say(instrument, "DATA:DATA? EMEMory2", "SYST:ERR?")
    assert back[-1] == '0,"No error"'


def test_a_load_setting_changes_the_volts_it_reckons_with():
    instrument = SimulatedAFG31052()
    say(instrument, "OUTP1:IMP 50", "SOUR1:VOLT:HIGH 1", "SOUR1:FUNC:SHAP EMEM1", "OUTP1 ON")
    assert instrument.seen[1].high_v == 2.0  # into high impedance, twice what it says
    say(instrument, "OUTP1:IMP INFinity")
    assert say(instrument, "OUTP1:IMP?", "SOUR1:VOLT:HIGH?") == ["9.9E+37", "2.0000E+00"]


def test_a_message_without_end_is_dropped():
    instrument = SimulatedAFG31052()
    say(instrument, "*CLS")
    for _ in range(300):
        instrument.feed(b"A" * 4096)
    assert say(instrument, "\n", "SYST:ERR?")[0].startswith("-223")
