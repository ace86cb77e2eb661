"""Forms that real instruments take and give: units, status, common commands; bounded memory."""

import tracemalloc

import numpy as np
import pytest

from hardware.simulated import (
    Clock,
    Device,
    Laboratory,
    Scan,
    SimulatedAFG31052,
    SimulatedInfiniiVision,
    SimulatedTLB6700,
    WiredLaboratory,
)
from hardware.simulated.instruments._scpi_instrument import MOST_ANSWERED
from rapi_jax.examples import paper_device


def say(instrument, *messages):
    """What comes back for messages sent one after the other."""
    sent = "".join(f"{one}\n" for one in messages).encode()
    answers = b"".join(answer.data for answer in instrument.feed(sent))
    return answers.decode("latin-1").split("\n")[:-1]


def error_of(instrument, message):
    """The number of the error that a message leaves."""
    say(instrument, "*CLS", message)
    return int(say(instrument, "SYST:ERR?")[0].split(",")[0])


@pytest.mark.parametrize(
    ("message", "query", "value"),
    [
        ("SOUR1:VOLT:HIGH 1.0V", "SOUR1:VOLT:HIGH?", 1.0),
        ("SOUR1:VOLT:HIGH 500mV", "SOUR1:VOLT:HIGH?", 0.5),
        ("SOUR1:VOLT:HIGH 2.5E2 MV", "SOUR1:VOLT:HIGH?", 0.25),
        ("SOUR1:VOLT 500mVpp", "SOUR1:VOLT?", 0.5),
        ("SOUR1:VOLT:OFFS 100MV", "SOUR1:VOLT:OFFS?", 0.1),
        ("SOUR1:FREQ 40Hz", "SOUR1:FREQ?", 40.0),
        ("SOUR1:FREQ 1.5kHz", "SOUR1:FREQ:CW?", 1500.0),
        ("SOUR1:FREQ 2 MHz", "SOUR1:FREQ?", 2e6),
        ("SOUR1:FREQ:FIX 33", "SOUR1:FREQ?", 33.0),
        ("SOUR1:FREQ 34", "SOUR1:FREQ:FIXed?", 34.0),
        ("SOUR1:FREQ MAX", "SOUR1:FREQ?", 25e6),
        ("OUTP1:IMP 50OHM", "OUTP1:IMP?", 50.0),
        ("OUTP1:IMP 1kohm", "OUTP1:IMP?", 1000.0),
        ("SOUR1:PHAS:ADJ 90DEG", "SOUR1:PHAS:ADJ?", np.pi / 2),
        ("SOUR1:SWE:TIME 20ms", "SOUR1:SWE:TIME?", 0.02),
    ],
)
def test_units(message, query, value):
    instrument = SimulatedAFG31052()
    assert error_of(instrument, message) == 0
    assert float(say(instrument, query)[0]) == pytest.approx(value)


@pytest.mark.parametrize(
    ("message", "code"),
    [
        ("SOUR1:VOLT:HIGH 1.0A", -131),
        ("SOUR1:VOLT:HIGH 1.0Hz", -131),
        ("SOUR1:FREQ 40s", -131),
        ("SOUR1:FREQ 40XHZ", -131),
        ("SOUR1:FREQ 1_000", -224),
        ("SOUR1:FREQ nan", -224),
        ("SOUR1:FREQ inf", -224),
        ("SOUR1:VOLT:HIGH MAX", -222),
        ("OUTP1:IMP 0.5OHM", -222),
        ("SOUR1:FREQ:MODE SWEEPING", -224),
        ("OUTP1:POL SIDEWAYS", -224),
    ],
)
def test_what_is_no_number_or_another_unit(message, code):
    assert error_of(SimulatedAFG31052(), message) == code


def scope():
    return SimulatedInfiniiVision(lambda *asked: None, clock=Clock())


@pytest.mark.parametrize(
    ("message", "query", "answer"),
    [
        (":CHAN1:RANG 1.4V", ":CHAN1:RANG?", "+1.40000E+00"),
        (":CHAN2:OFFS -250mV", ":CHAN2:OFFS?", "-2.50000E-01"),
        (":TIM:RANG 10ms", ":TIM:RANG?", "+1.00000E-02"),
        (":TRIG:EDGE:LEV 1.5V", ":TRIG:EDGE:LEV?", "+1.50000E+00"),
        (":TRIG:EDGE:SOUR EXTernal", ":TRIG:EDGE:SOUR?", "EXT"),
        (":TRIG:EDGE:SOUR CHANnel3", ":TRIG:EDGE:SOUR?", "CHAN3"),
        (":ACQuire:TYPE HRESolution", ":ACQ:TYPE?", "HRES"),
        (":CHAN1:IMP FIFTy", ":CHAN1:IMP?", "FIFT"),
        (":CHAN1:INV ON", ":CHAN1:INV?", "1"),
        (":TIM:REF CENTer", ":TIM:REF?", "CENT"),
    ],
)
def test_the_oscilloscope_reads_back(message, query, answer):
    instrument = scope()
    assert error_of(instrument, message) == 0 and say(instrument, query) == [answer]


@pytest.mark.parametrize(
    "message",
    [
        ":TRIG:EDGE:SOUR CHAN5", ":TRIG:EDGE:SOUR NOWHERE", ":WAV:SOUR CHAN9", ":DIG CHAN7",
        ":ACQ:TYPE GUESS",
    ],
)  # fmt: skip
def test_a_source_that_does_not_exist_is_refused(message):
    assert error_of(scope(), message) == -224


def test_a_command_without_its_parameter_ends_nothing():
    assert error_of(scope(), ":WAV:SOUR") == -109


def seeing_half_a_volt():
    clock = Clock()
    instrument = SimulatedInfiniiVision(
        lambda now, first, count, hz: {1: np.full(count, 0.5)}, clock=clock
    )
    say(instrument, ":TRIG:EDGE:SOUR EXT", ":TRIG:EDGE:LEV 1.5", ":TIM:RANG 1E-3")
    return clock, instrument


def test_a_single_record_is_asked_for_until_it_is_there():
    clock, instrument = seeing_half_a_volt()
    assert say(instrument, ":SING", ":OPER:COND?") == ["8"]
    clock.sleep(1.0)
    assert say(instrument, ":OPER:COND?") == ["0"]
    assert say(instrument, ":WAV:SOUR CHAN1;:WAV:PRE?")[0].split(",")[2] == "1000"


def test_digitize_takes_a_record_before_what_is_asked_next_is_answered():
    _, instrument = seeing_half_a_volt()
    (answer,) = instrument.feed(b":DIG CHAN1\n:OPER:COND?\n")
    assert (answer.data, answer.after_s) == (b"0\n", 1e-3)
    assert say(instrument, ":WAV:POIN:MODE RAW;:WAV:POIN MAX;:WAV:PRE?")[0].split(",")[2] == "50000"


@pytest.mark.parametrize("unsigned", [0, 1])
@pytest.mark.parametrize("order", ["MSBF", "LSBF"])
@pytest.mark.parametrize("kind", ["BYTE", "WORD", "ASC"])
def test_a_record_means_the_same_in_every_format(kind, order, unsigned):
    _, instrument = seeing_half_a_volt()
    say(instrument, ":DIG", f":WAV:FORM {kind};:WAV:BYT {order};:WAV:UNS {unsigned}")
    about = [float(x) for x in say(instrument, ":WAV:PRE?")[0].split(",")]
    (answer,) = instrument.feed(b":WAV:DATA?\n")
    data = answer.data[10:-1]
    assert answer.data[:10] == b"#8%08d" % len(data)
    if kind == "ASC":
        volts = np.array([float(x) for x in data.split(b",")])
    else:
        ends = ("<" if order == "LSBF" else ">") + ("u" if unsigned else "i")
        codes = np.frombuffer(data, ends + ("1" if kind == "BYTE" else "2"))
        volts = (codes.astype(float) - about[9]) * about[7] + about[8]
    assert volts.size == about[2] == 1000 and about[4] == pytest.approx(1e-6)
    assert np.abs(volts - 0.5).max() <= 0.51 * 8.0 / 4095 + about[7]  # 12 bits over 8 V


def test_common_commands_and_the_status_byte():
    instrument = SimulatedAFG31052()
    assert say(instrument, "*CLS", "*OPT?", "*WAI", "*STB?") == ["0", "0"]
    assert say(instrument, "*IDN?;*STB?")[0].endswith(";16")  # an answer waits before it
    say(instrument, "NONSENSE")
    assert say(instrument, "*STB?") == ["4"]
    assert say(instrument, "*ESE 32;*STB?") == ["36"]
    assert say(instrument, "*SRE 32;*STB?") == ["100"]
    assert say(instrument, "*ESR?", "SYST:ERR?", "*STB?")[-1] == "0"
    assert say(instrument, "*OPC", "*ESR?") == ["1"]


def test_answers_that_would_not_fit_are_dropped():
    """A message of 1 MiB asks 58 000 times for 262 kB."""
    instrument = SimulatedAFG31052()
    content = np.zeros(131072, ">u2").tobytes()
    list(instrument.feed(b"*CLS\nDATA:DATA EMEM1,#6262144" + content + b"\n"))
    tracemalloc.start()
    try:
        for message in (";".join(["DATA:DATA? EMEM1"] * 58_000), "\n".join(["DATA:DATA?"] * 500)):
            answers = instrument.feed(message.replace("DATA?\n", "DATA? EMEM1\n").encode() + b"\n")
            assert sum(len(answer.data) for answer in answers) <= MOST_ANSWERED + 1000
            assert say(instrument, "SYST:ERR?")[0].startswith("-430")
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 4 * MOST_ANSWERED
    assert say(instrument, "*CLS", "SOUR1:FREQ 20", "SYST:ERR?") == ['0,"No error"']


@pytest.mark.parametrize(
    "setup",
    [
        (":TIM:POS 500",),
        (":TIM:POS -500",),
        (":TIM:RANG 50", ":TIM:POS 500"),
        (":TIM:REF RIGH", ":TIM:RANG 2E-8", ":TIM:POS 400"),
    ],
)
@pytest.mark.parametrize("hertz", [1e-6, 40.0, 25e6])
def test_a_record_far_from_its_trigger_takes_no_memory(setup, hertz):
    clock = Clock()
    lab = WiredLaboratory(Laboratory(Device(paper_device())), clock=clock)
    say(lab.generator, f"SOUR1:FREQ {hertz}", "OUTP1 ON")
    say(lab.oscilloscope, ":TRIG:EDGE:SOUR EXT", ":TRIG:EDGE:LEV 1.5", *setup, ":SING")
    clock.sleep(1e4)
    assert say(lab.oscilloscope, ":OPER:COND?") == ["8"]  # it waits


@pytest.mark.parametrize("held", [True, False])
def test_many_periods_are_looked_up_without_a_copy_of_each(held):
    rng = np.random.default_rng(3)
    scan = Scan(rng.normal(size=500), 1e6, 1, held)
    time = np.linspace(0.3e-6, 90e-6, 700)  # 90 periods
    parts = np.concatenate([scan.at(part) for part in np.split(time, 7)])  # 13 at once
    assert scan.at(time) == pytest.approx(parts, abs=1e-6)
    tracemalloc.start()
    try:
        scan.at(np.linspace(0.0, 100.0, 1000))  # 1e8 periods
        assert tracemalloc.get_traced_memory()[1] < 1e6
    finally:
        tracemalloc.stop()


def test_faults_that_nobody_reads_do_not_pile_up():
    instrument = SimulatedTLB6700()
    for _ in range(100):
        instrument.feed(b"NONSENSE\r\n" * 100)
    assert len(instrument._faults) <= 32
