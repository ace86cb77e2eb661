"""The exact bytes of every command of the oscilloscope, against the table it was written from."""

import re

import numpy as np
import pytest
from transcript import DONE, Transcript, command

from hardware import Acquisition, InfiniiVision, Input, InstrumentError, Scpi

IDN = "KEYSIGHT TECHNOLOGIES,DSO-X 3034T,MY58100001,07.50.2021102830"
OPEN = (("*IDN?", IDN), ("*CLS", None), ("*OPC?", "1"))
ASKED = Acquisition({"interferometer": Input(1, -0.2, 1.2)}, before_s=1e-3, after_s=9e-3)

# Headers as the programmer's guide of the series writes them.
TABLE = """
:STOP :SINGle :OPERegister:CONDition
:ACQuire:MODE :ACQuire:TYPE :ACQuire:SRATe
:TIMebase:MODE :TIMebase:REFerence :TIMebase:RANGe :TIMebase:POSition
:CHANnel1:DISPlay :CHANnel1:COUPling :CHANnel1:INVert :CHANnel1:PROBe :CHANnel1:RANGe
:CHANnel1:OFFSet :CHANnel1:IMPedance :CHANnel1:BWLimit :CHANnel1:UNITs :CHANnel1:PROBe:SKEW
:TRIGger:MODE :TRIGger:EDGE:SOURce :TRIGger:EDGE:SLOPe :TRIGger:EDGE:LEVel :TRIGger:SWEep
:TRIGger:EDGE:COUPling :TRIGger:EDGE:REJect :TRIGger:HFReject :TRIGger:NREJect :TRIGger:HOLDoff
:EXTernal:PROBe
:WAVeform:SOURce :WAVeform:POINts:MODE :WAVeform:POINts :WAVeform:FORMat :WAVeform:BYTeorder
:WAVeform:UNSigned :WAVeform:PREamble :WAVeform:DATA
*IDN *CLS *OPC *ESR SYSTem:ERRor
""".split()


def put(header, value, *, reads=None):
    """A setting, and what is read back."""
    return (*command(f"{header} {value}"), (f"{header}?", value if reads is None else reads))


CONFIGURE = (
    *command(":STOP"),
    *put(":ACQ:MODE", "RTIM"),
    *put(":ACQ:TYPE", "NORM"),
    *put(":TIM:MODE", "MAIN"),
    *put(":TIM:REF", "LEFT"),
    *put(":TIM:RANG", "1.020000E-02", reads="+1.02000E-02"),
    (":TIM:RANG?", "+1.02000E-02"),
    *put(":TIM:POS", "1.000000E-05"),
    *put(":CHAN1:DISP", "1"),
    *put(":CHAN1:COUP", "DC"),
    *put(":CHAN1:INV", "0"),
    *put(":CHAN1:BWL", "0"),
    *put(":CHAN1:UNIT", "VOLT"),
    *put(":CHAN1:PROB", "1.000000E+00", reads="+1.00E+00"),
    *put(":CHAN1:PROB:SKEW", "0.000000E+00", reads="+0.0E+00"),
    *put(":CHAN1:RANG", "1.400000E+00", reads="+1.60E+00"),  # the next that it has
    *put(":CHAN1:OFFS", "5.000000E-01"),
    *put(":TRIG:MODE", "EDGE"),
    *put(":TRIG:EDGE:SOUR", "EXT", reads="EXTernal"),  # as some firmware writes it
    *put(":TRIG:EDGE:SLOP", "POS"),
    *put(":TRIG:EDGE:COUP", "DC"),
    *put(":TRIG:EDGE:REJ", "OFF"),
    *put(":TRIG:HFR", "0"),
    *put(":TRIG:NREJ", "0"),
    *put(":TRIG:SWE", "NORM"),
    *put(":TRIG:HOLD", "6.000000E-08", reads="+6.0E-08"),
    *put(":EXT:PROB", "1.000000E+00", reads="+1.000E+00"),
    *put(":TRIG:EDGE:LEV", "1.500000E+00"),
)
ARM = command(":SING")
RUNNING, STOPPED = (":OPER:COND?", "+8"), (":OPER:COND?", "+0")
CODES = np.linspace(-32768, 32752, 110_000).astype(np.int16)
READ = (
    *command(":WAV:SOUR CHAN1"),
    *command(":WAV:POIN:MODE RAW"),
    *command(":WAV:POIN MAX"),
    *command(":WAV:FORM WORD"),
    *command(":WAV:BYT MSBF"),
    *command(":WAV:UNS 0"),
    (":WAV:PRE?", "+1,+0,+110000,+1,+1.0E-07,-1.1E-03,+0,+2.0E-05,+0.5,+100"),
    (":WAV:DATA?", b"#800220000" + CODES.astype(">i2").tobytes()),
)
SNAPSHOT = {
    ":ACQ:MODE": "RTIM", ":ACQ:TYPE": "NORM", ":TIM:MODE": "MAIN", ":TIM:REF": "LEFT",
    ":TIM:RANG": "+1.02E-02", ":TIM:POS": "+1.0E-05", ":CHAN1:DISP": "1", ":CHAN1:COUP": "DC",
    ":CHAN1:INV": "0", ":CHAN1:BWL": "0", ":CHAN1:UNIT": "VOLT", ":CHAN1:PROB": "+1.0",
    ":CHAN1:PROB:SKEW": "+0.0E+00", ":CHAN1:RANG": "+1.6", ":CHAN1:OFFS": "+0.5",
    ":TRIG:MODE": "EDGE", ":TRIG:EDGE:SOUR": "EXT", ":TRIG:EDGE:SLOP": "POS",
    ":TRIG:EDGE:COUP": "DC", ":TRIG:EDGE:REJ": "OFF", ":TRIG:HFR": "0", ":TRIG:NREJ": "0",
    ":TRIG:SWE": "NORM", ":TRIG:HOLD": "+6.0E-08", ":EXT:PROB": "+1.0",
    ":TRIG:EDGE:LEV": "+1.5", ":ACQ:SRAT": "+1.0E+07", ":CHAN1:IMP": "ONEM",
}  # fmt: skip
ASK = tuple((f"{header}?", reply) for header, reply in SNAPSHOT.items())


def scope_after(link):
    """An oscilloscope that is configured."""
    scope = InfiniiVision(Scpi(link))
    scope.configure(ASKED)
    return scope


def test_it_is_identified_and_cleared():
    with Transcript(*OPEN) as link:
        assert InfiniiVision(Scpi(link)).identity == IDN


def test_it_is_configured():
    with Transcript(*OPEN, *CONFIGURE) as link:
        scope_after(link)
    assert link.whole


def test_a_record_is_asked_for_and_read():
    with Transcript(*OPEN, *CONFIGURE, *ARM, RUNNING, STOPPED, *READ) as link:
        scope = scope_after(link)
        scope.arm()
        samples = scope.fetch(1.0)
    assert (samples.codes["interferometer"] == CODES).all()
    volts = 0.5 + (CODES.astype(float) - 100) * 2e-5  # (code - reference) * increment + origin
    np.testing.assert_allclose(samples.volts("interferometer"), volts, rtol=0, atol=1e-12)
    assert (samples.sample_hz, samples.start_s) == pytest.approx((1e7, -1.1e-3))


def test_without_a_trigger_it_is_stopped():
    with Transcript(*OPEN, *CONFIGURE, *ARM, RUNNING, *command(":STOP")) as link:
        scope = scope_after(link)
        scope.arm()
        with pytest.raises(InstrumentError, match="No trigger came"):
            scope.fetch(0.0)


def test_its_settings_are_asked_for():
    with Transcript(*OPEN, *CONFIGURE, *ASK) as link:
        told = scope_after(link).snapshot()
    assert told.pop("identity") == IDN
    assert told == {header.strip(":"): reply for header, reply in SNAPSHOT.items()}


def test_it_is_stopped_at_the_end():
    with Transcript(*OPEN, *command(":STOP")) as link:
        InfiniiVision(Scpi(link)).close()
    assert link.whole


def test_a_setting_that_was_not_taken_is_refused():
    lines = [*OPEN, *CONFIGURE]
    at = lines.index((":TRIG:EDGE:LEV?", "1.500000E+00"))
    lines[at] = (":TRIG:EDGE:LEV?", "+0.0")
    with Transcript(*lines[: at + 1]) as link:
        with pytest.raises(InstrumentError, match="TRIG:EDGE:LEV"):
            scope_after(link)


def test_a_state_that_was_not_taken_is_refused():
    lines = [*OPEN, *CONFIGURE]
    at = lines.index((":CHAN1:INV?", "0"))
    lines[at] = (":CHAN1:INV?", "1")
    with Transcript(*lines[: at + 1]) as link:
        with pytest.raises(InstrumentError, match="CHAN1:INV 0.*another setting"):
            scope_after(link)


def test_the_conversations_hold_every_header_of_the_table_and_no_other():
    def abbreviated(header):
        return re.sub("[a-z]", "", header)

    lines = (*OPEN, *CONFIGURE, *ARM, RUNNING, *READ, *ASK, *DONE)
    sent = {re.split(r"[ ?]", line)[0] for line, _ in lines}
    assert sent == {abbreviated(header) for header in TABLE}
