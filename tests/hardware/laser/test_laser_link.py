"""Ways to the laser controller: strays, late answers, noise, the vendor's library, the bridge."""

import ctypes
import random

import pytest

from hardware import Bridge, InstrumentError, VendorDllLink, VisaLaserLink
from hardware.laser._commands import fault, is_stray
from hardware.laser._link import select_answer
from hardware.simulated import (
    Closing,
    Cut,
    Endless,
    Faulty,
    Instead,
    Silent,
    SimulatedLink,
    SimulatedTLB6700,
    Slow,
)

IDENTITY = "New_Focus 6700 v2.4 03/19/14 SN1012"


@pytest.mark.parametrize(
    ("line", "stray"),
    [
        (IDENTITY, True),
        ("v2.4 03/19/14 SN1012", True),
        ("New_Focus 6700 v2.4 03/19/14 SN", True),
        ("New_Focus 6700 v2", True),
        (".4 03/19/14 SN1012", True),
        ("us 6700 v2.4 03/19/14 SN1012", True),
        ("Newport 6700 v2.4 03/19/14", True),
        ("6700 SN1012", True),
        ("6712", False),
        ("VALUE OUT OF RANGE", False),
        ('501,"LDD INTERLOCK FLT"', False),
        ("OK", False),
        ("770.50", False),
        ("TLB-6712", False),
        ("", False),
    ],
)
def test_an_identity_is_told_from_an_answer(line, stray):
    assert is_stray(line) == stray


def test_the_line_that_answers():
    assert select_answer("SOURce:WAVElength?", ["770.50", IDENTITY]) == "770.50"
    assert select_answer("*IDN?", [IDENTITY]) == IDENTITY
    assert select_answer("SENSe:WAVElength", ["OK", "770.50"]) == "770.50"
    assert select_answer("SOURce:WAVElength?", ["770.50", "OK", IDENTITY]) == "770.50"
    with pytest.raises(ValueError, match="no line"):
        select_answer("SOURce:WAVElength?", ["OK"])
    with pytest.raises(ValueError, match="no line"):
        select_answer("OUTPut:STATe 1", [IDENTITY])
    with pytest.raises(ValueError, match="more than one"):
        select_answer("OUTPut:STATe 1", ["OK", "770.50"])


@pytest.mark.parametrize(
    ("line", "entry"),
    [
        ('0,"NO ERROR"', (0, "NO ERROR")),
        ('501,"LDD INTERLOCK FLT"', (501, "LDD INTERLOCK FLT")),
        ("501, LDD INTERLOCK FLT", (501, "LDD INTERLOCK FLT")),
        ("804", (804, "PIEZO OVER TEMP")),
        ("NO ERROR", (0, "NO ERROR")),
    ],
)
def test_faults_are_read(line, entry):
    assert fault(line) == entry


@pytest.mark.parametrize("line", ["OK", "", "12345,x", '5"', "nan"])
def test_what_is_no_fault_is_refused(line):
    with pytest.raises(ValueError, match="not an entry"):
        fault(line)


@pytest.mark.fault(
    name="a laser controller that is silent, slow or lying",
    promise="an answer that is one, or an error in time",
)
@pytest.mark.parametrize(
    "peer",
    [
        Silent(),
        Slow(5.0),
        Closing(0),
        Closing(1),
        Cut(2),
        Endless(),
        Instead(b"\r\n\r\n"),
        Instead(b"\x00" * 64),
        Instead(b"9" * 70 + b"\r\n"),
        Instead(b"OK\r\nOK\r\n"),
    ],
    ids=repr,
)
def test_peers_that_misbehave(peer):
    """An answer that is one, or an error in time; and the next command is answered right."""
    wire = SimulatedLink(Faulty(SimulatedTLB6700(), peer, when=b"TRACk", times=1))
    link = VisaLaserLink(wire, timeout_s=1.0)
    began = wire.clock_s
    try:
        assert link.query("OUTPut:TRACk 0") == "OK"
    except InstrumentError as error:
        assert error.command == "OUTPut:TRACk 0"
    assert wire.clock_s - began < 2.0
    try:
        said = link.query("SOURce:CURRent:DIODe?")
    except InstrumentError:  # what still lay there was seen, and thrown away with the connection
        said = link.query("SOURce:CURRent:DIODe?")
    assert said == "120.00"


@pytest.mark.fault(
    name="random bytes as a laser controller's answer",
    promise="a line as it was sent, or an error",
    trials=10000,
)
def test_noise_never_becomes_an_answer():
    """10 000 answers of random bytes: a line as it was sent, or an error.

    The first line that is no `OK`, which no query is answered by.
    """
    rng, instrument = random.Random(5), SimulatedTLB6700()
    for _ in range(10_000):
        data = bytes(rng.choice(b'OK0129.,"\r\n\x00\xffv ') for _ in range(rng.randint(0, 90)))
        wire = SimulatedLink(Faulty(instrument, Instead(data), times=1))
        link = VisaLaserLink(wire, timeout_s=0.1)
        try:
            said = link.query("SENSe:WAVElength")
        except InstrumentError as error:
            assert all(32 <= ord(letter) <= 126 for letter in str(error))
            continue
        lines = [line.removesuffix(b"\r") for line in data.split(b"\n")]
        assert said.encode() == next(line for line in lines if line != b"OK") and len(said) <= 64


class Library:
    """What the vendor's library does, with a controller behind it."""

    def __init__(self, instrument, listed="0,6700 SN1012;"):
        self.instrument = instrument
        self.listed = listed
        self.opened = 0
        self.empty_reads = 0
        self.fails = False
        self._reply = b""

    def newp_usb_init_product(self, product):
        assert product == 0x100A
        self.opened += 1

    def newp_usb_get_device_info(self, buffer):
        ctypes.memmove(buffer, self.listed.encode() + b"\0", len(self.listed) + 1)
        return 0

    def newp_usb_send_ascii(self, number, packet, length):
        assert number == 0 and ctypes.sizeof(packet) == 64
        if self.fails:
            return -1
        answers = self.instrument.feed(packet.raw[: length.value] + b"\r\n")
        self._reply = b"".join(answer.data for answer in answers)
        return 0

    def newp_usb_get_ascii(self, number, buffer, size, count):
        assert number == 0
        data = self._reply
        if self.empty_reads:
            self.empty_reads -= 1
            data = IDENTITY.encode() + b"\r\n"
        data = data[: size.value]
        ctypes.memmove(buffer, data + b"\0", len(data) + 1)
        ctypes.cast(count, ctypes.POINTER(ctypes.c_ulong))[0] = 64
        return 0

    def newp_usb_uninit_system(self):
        self.opened -= 1


def test_the_vendors_library():
    library = Library(SimulatedTLB6700(stray_every=2), "1,6700 SN77;0,6700 SN1012;")
    with VendorDllLink("1012", dll=library) as link:
        assert link.query("*IDN?") == IDENTITY
        assert link.query("OUTPut:TRACk 1") == "OK"
        assert link.query("SOURce:WAVElength?") == "770.00"
        library.empty_reads = 2  # the identity comes in place of the answer, which comes later
        assert link.query("OUTPut:TRACk?") == "1"
    assert library.opened == 0


@pytest.mark.parametrize("serial", ["SN1012", "1012", "6700 SN1012", "sn1012", "TLB-6700 SN 1012"])
def test_serial_numbers_as_they_are_written(serial):
    with VendorDllLink(serial, dll=Library(SimulatedTLB6700())) as link:
        assert link.query("*IDN?") == IDENTITY


@pytest.mark.parametrize("serial", ["", "SN", "6700", "SN1012; DROP"])
def test_what_is_no_serial_number(serial):
    if serial == "6700":  # a number alone is one
        with pytest.raises(InstrumentError, match="no controller SN6700"):
            VendorDllLink(serial, dll=Library(SimulatedTLB6700()))
        return
    with pytest.raises(ValueError, match="no serial number"):
        VendorDllLink(serial, dll=Library(SimulatedTLB6700()))


@pytest.mark.fault(name="the vendor's library fails", promise="one error that says so")
def test_the_vendors_library_fails():
    library = Library(SimulatedTLB6700())
    with pytest.raises(InstrumentError, match="no controller SN9"):
        VendorDllLink("SN9", dll=library)
    assert library.opened == 0
    link = VendorDllLink("SN1012", dll=library)
    library.fails = True
    with pytest.raises(InstrumentError, match="could not send"):
        link.query("*IDN?")
    assert library.opened == 0  # its error goes away when it is opened anew
    library.fails = False
    assert link.query("*IDN?") == IDENTITY
    with pytest.raises(ValueError, match="fewer than 64"):
        link.query("X" * 64)
    link.close()


def test_no_library_here():
    with pytest.raises(InstrumentError, match=r"Windows alone|could not be loaded"):
        VendorDllLink("SN1012", library="no-such-library.dll")


def bridged(instrument, **settings):
    behind = VisaLaserLink(SimulatedLink(instrument), timeout_s=0.2)
    return VisaLaserLink(SimulatedLink(Bridge(behind)), timeout_s=1.0, **settings)


def test_the_bridge_passes_on_and_cleans():
    link = bridged(SimulatedTLB6700(stray_every=1))
    assert link.query("OUTPut:TRACk 1") == "OK"
    assert link.query("SOURce:WAVElength?") == "770.00"
    assert link.query("*IDN?") == IDENTITY


def test_what_fails_behind_the_bridge_is_said():
    link = bridged(Faulty(SimulatedTLB6700(), Silent(), when=b"TRACk", times=1))
    assert link.query("OUTPut:TRACk 1") == "BRIDGE: no answer"
    assert link.query("OUTPut:TRACk?") == "1"
    assert link.query("X" * 100).startswith("BRIDGE: the line is too long")
