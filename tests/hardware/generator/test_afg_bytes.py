"""The exact bytes of every command of the generator, against the table it was written from."""

import math
import re

import numpy as np
import pytest
from transcript import Transcript, command

from hardware import AFG31000, DriveLimits, InstrumentError, Scpi
from hardware.generator._levels import Levels
from hardware.generator._port import AfgPort
from hardware.simulated import SimulatedAFG31052, SimulatedLink

IDN = "TEKTRONIX,AFG31052,C012345,SCPI:99.0 FV:1.6.1"
OPEN = (("*IDN?", IDN), ("*CLS", None), ("*OPC?", "1"))

# Header as the manual writes it, what is done to channel 1, and the conversation of it.
ROWS = {
    "DATA:DATA": (
        lambda port: port.upload(np.array([0, 1, 258, 16382], np.uint16)),
        (
            *command(b"DATA:DATA EMEM1,#6000008\x00\x00\x00\x01\x01\x02\x3f\xfe"),
            ("DATA:POIN? EMEM1", "4"),
        ),
    ),
    "SOURce1:FUNCtion:SHAPe": (
        lambda port: port.select(),
        (*command("SOUR1:FUNC:SHAP EMEM1"), ("SOUR1:FUNC:SHAP?", "EMEM1")),
    ),
    "SOURce1:FREQuency": (
        lambda port: port.set_frequency(20.0),
        (*command("SOUR1:FREQ 20.000000"), ("SOUR1:FREQ?", "2.0000000000E+01")),
    ),
    "SOURce1:VOLTage:LEVel:IMMediate:HIGH": (
        lambda port: port.set_levels(Levels(0.0, 0.5), Levels(0.0, 7.25)),
        (
            *command("SOUR1:VOLT:LEV:IMM:HIGH 7.2500"),
            ("SOUR1:VOLT:LEV:IMM:LOW?", "0.0000E+00"),
            ("SOUR1:VOLT:LEV:IMM:HIGH?", "7.2500E+00"),
        ),
    ),
    "SOURce1:VOLTage:LEVel:IMMediate:LOW": (
        lambda port: port.set_levels(Levels(0.0, 7.25), Levels(-0.0125, 7.25)),
        (
            *command("SOUR1:VOLT:LEV:IMM:LOW -0.0125"),
            ("SOUR1:VOLT:LEV:IMM:LOW?", "-0.0125"),
            ("SOUR1:VOLT:LEV:IMM:HIGH?", "7.25"),
        ),
    ),
    "SOURce1:VOLTage:LIMit:HIGH": (
        lambda port: port.set_clamp_high(7.5),
        command("SOUR1:VOLT:LIM:HIGH 7.5000"),
    ),
    "SOURce1:VOLTage:LIMit:LOW": (
        lambda port: port.set_clamp_low(0.0),
        command("SOUR1:VOLT:LIM:LOW 0.0000"),
    ),
    "OUTPut1:IMPedance": (
        lambda port: port.set_load(math.inf),
        (*command("OUTP1:IMP INF"), ("OUTP1:IMP?", "9.9E+37")),
    ),
    "OUTPut1:STATe": (
        lambda port: port.switch(True),
        (*command("OUTP1:STAT ON"), ("OUTP1:STAT?", "1")),
    ),
    "SOURce1:PHASe:INITiate": (lambda port: port.align(), command("SOUR1:PHAS:INIT")),
}


def abbreviated(header):
    """Each mnemonic by its upper-case letters and digits."""
    return ":".join(re.sub("[a-z]", "", part) for part in header.split(":"))


@pytest.mark.parametrize("header", ROWS)
def test_bytes_of_a_command(header):
    act, lines = ROWS[header]
    sent = lines[0][0] if isinstance(lines[0][0], bytes) else lines[0][0].encode()
    assert sent.startswith(abbreviated(header).encode())
    with Transcript(*lines) as link:
        act(AfgPort(Scpi(link), 1))


def test_the_second_channel_has_its_own_memory():
    lines = (*command(b"DATA:DATA EMEM2,#6000004\x00\x00\x00\x01"), ("DATA:POIN? EMEM2", "2"))
    lines += (*command("SOUR2:FUNC:SHAP EMEM2"), ("SOUR2:FUNC:SHAP?", "EMEM2"))
    with Transcript(*lines, ("DATA:DATA? EMEM2", "#14\x00\x00\x00\x01")) as link:
        port = AfgPort(Scpi(link), 2)
        port.upload(np.array([0, 1], np.uint16))
        port.select()
        assert port.read_back(2).tolist() == [0, 1]


@pytest.mark.parametrize("name", ["EMEM", "EMEM1", "EMEMory1", "EMEMORY"])
def test_the_first_memory_may_be_named_without_its_number(name):
    lines = (*command("SOUR1:FUNC:SHAP EMEM1"), ("SOUR1:FUNC:SHAP?", name))
    with Transcript(*lines) as link:
        AfgPort(Scpi(link), 1).select()
        assert link.whole


@pytest.mark.parametrize(("n", "name"), [(1, "EMEM2"), (2, "EMEM"), (2, "EMEM1"), (1, "SIN")])
def test_another_memory_is_refused(n, name):
    lines = (*command(f"SOUR{n}:FUNC:SHAP EMEM{n}"), (f"SOUR{n}:FUNC:SHAP?", name))
    with Transcript(*lines) as link, pytest.raises(InstrumentError, match="another form"):
        AfgPort(Scpi(link), n).select()


def test_a_run_on_an_instrument_that_says_emem():
    instrument = SimulatedAFG31052(first_memory="EMEM")
    with AFG31000(Scpi(SimulatedLink(instrument))) as afg:
        channel = afg.channel(1, limits=DriveLimits(0.0, 7.5, 2000.0, 0.5, 100.0))
        channel.load(np.array([1.0, 1.2, 1.4, 1.2]), 20.0)
        channel.start()
        assert channel.settings()["SOUR1:FUNC:SHAP"] == "EMEM" and instrument.output(1) is not None


def test_the_longest_upload_has_262144_bytes():
    codes = (np.arange(131072) % 16383).astype(np.uint16)
    sent = b"DATA:DATA EMEM1,#6262144" + codes.astype(">u2").tobytes()
    with Transcript(*command(sent), ("DATA:POIN? EMEM1", "131072")) as link:
        AfgPort(Scpi(link), 1).upload(codes)
        assert link.whole


def test_trigger():
    lines = (*command("TRIG:SOUR EXT"), ("TRIG:SOUR?", "EXT"))
    lines += (*command("OUTP:TRIG:MODE SYNC"), ("OUTP:TRIG:MODE?", "SYNC"))
    with Transcript(*OPEN, *lines) as link:
        AFG31000(Scpi(link)).set_trigger(source="EXT", output="SYNC")
        assert link.whole


def test_a_channel_is_off_then_loaded_then_clamped():
    """As another user left it: inverted, with noise, and coupled to channel 2."""
    low, high = "SOUR1:VOLT:LEV:IMM:LOW", "SOUR1:VOLT:LEV:IMM:HIGH"
    lines = (
        ("SEQC:STAT?", "0"),
        ("SOUR1:VOLT:CONC:STAT?", "0"),
        ("SOUR2:VOLT:CONC:STAT?", "1"),
        *command("SOUR2:VOLT:CONC:STAT OFF"),
        ("SOUR2:VOLT:CONC:STAT?", "0"),
        ("SOUR1:FREQ:CONC:STAT?", "0"),
        ("SOUR2:FREQ:CONC:STAT?", "0"),
        ("OUTP1:STAT?", "0"),
        *command("OUTP1:STAT OFF"),
        ("OUTP1:STAT?", "0"),
        ("SOUR1:FREQ:MODE?", "CW"),
        ("SOUR1:AM:STAT?", "0"),
        ("SOUR1:FM:STAT?", "0"),
        ("SOUR1:PM:STAT?", "0"),
        ("SOUR1:FSK:STAT?", "0"),
        ("SOUR1:PWM:STAT?", "0"),
        ("SOUR1:COMB:FEED?", '"NOIS"'),
        *command('SOUR1:COMB:FEED ""'),
        ("SOUR1:COMB:FEED?", '""'),
        ("SOUR1:BURS:STAT?", "0"),
        ("OUTP1:POL?", "INV"),
        *command("OUTP1:POL NORM"),
        ("OUTP1:POL?", "NORM"),
        ("SOUR1:PHAS:ADJ?", "0.0000E+00"),
        *command("OUTP1:IMP INF"),
        ("OUTP1:IMP?", "9.9E+37"),
        ("SOUR1:VOLT:LIM:LOW?", "-1.0000E+01"),
        ("SOUR1:VOLT:LIM:HIGH?", "1.0000E+01"),
        (low + "?", "-1.0000E+00"),
        (high + "?", "1.0000E+00"),
        *command(low + " 0.0000"),
        *command(high + " 0.0040"),
        (low + "?", "0.0000E+00"),
        (high + "?", "4.0000E-03"),
        *command("SOUR1:VOLT:LIM:LOW 0.0000"),
        *command("SOUR1:VOLT:LIM:HIGH 7.5000"),
        ("SOUR1:VOLT:LIM:LOW?", "0.0000E+00"),
        ("SOUR1:VOLT:LIM:HIGH?", "7.5000E+00"),
    )
    limits = DriveLimits(0.0, 7.5, 2000.0, 0.05, 100.0)
    with Transcript(*OPEN, *lines) as link:
        channel = AFG31000(Scpi(link)).channel(1, limits=limits)
        assert not channel.on
        assert channel.undone == ("SOUR2:VOLT:CONC:STAT", "SOUR1:COMB:FEED", "OUTP1:POL")
