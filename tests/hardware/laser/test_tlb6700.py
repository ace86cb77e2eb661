"""The laser controller: exact bytes, limits, faults; over every way that leads to it."""

import pytest
from transcript import Transcript

from hardware import (
    TLB6700,
    Bridge,
    HislipServer,
    InstrumentError,
    LaserLimits,
    TcpServer,
    VisaLaserLink,
    VisaLink,
)
from hardware.simulated import SimulatedLink, SimulatedTLB6700
from rapi_jax import LimitError

LIMITS = LaserLimits(
    wavelength_nm=(765.0, 781.0),
    piezo_percent=(0.0, 100.0),
    current_ma=(30.0, 140.0),
    diode_c=(15.0, 30.0),
    cavity_c=(20.0, 40.0),
)
OK = "OK\r"


class Pair:
    """A simulated controller and the link to it, on one clock."""

    def __init__(self, **settings):
        self.link = None
        self.instrument = SimulatedTLB6700(
            clock=lambda: self.link.clock_s if self.link else 0.0, **settings
        )
        self.link = SimulatedLink(self.instrument, keep=True)

    def laser(self, limits=LIMITS):
        return TLB6700(VisaLaserLink(self.link), limits=limits)


def line(sent, reply):
    """One command and its answer, as they stand on the wire."""
    return sent + "\r", reply + "\r"


def done(sent, *, read=None):
    """A setting, the look at the status, and what is read back."""
    lines = (line(sent, "OK"), line("*STB?", "0"))
    return lines if read is None else (*lines, line(*read))


def greeting():
    return (
        line("*IDN?", "New_Focus 6700 v2.4 03/19/14 SN1012"),
        line("SYSTem:LASer:MODEL?", "TLB-6712"),
        line("ERRSTR?", '0,"NO ERROR"'),
        *done("SYSTem:MCONtrol REM"),
        *done("OUTPut:SCAN:STOP"),
        *done("OUTPut:TRACk 0", read=("OUTPut:TRACk?", "0")),
        line("SYSTem:WINPut?", "0"),
        line("*STB?", "0"),
        line("SENSe:TEMPerature:DIODe", "20.00"),
        line("SENSe:TEMPerature:CAVity", "30.00"),
    )


REST = (  # at rest, as it is looked at before a scan
    line("SYSTem:LASer:MODEL?", "TLB-6712"),
    line("SYSTem:MCONtrol?", "REM"),
    line("OUTPut:STATe?", "1"),
    line("OUTPut:TRACk?", "0"),
    line("SYSTem:WINPut?", "0"),
    line("SOURce:CPOWer?", "0"),
    line("SOURce:WAVElength?", "770.00"),
    line("SOURce:VOLTage:PIEZo?", "50.00"),
    line("SOURce:CURRent:DIODe?", "120.00"),
    line("SOURce:WAVE:SCANCFG?", "0"),
    line("SOURce:WAVE:DESSCANS?", "5"),
    line("*OPC?", "1"),
)
FAREWELL = (
    *done("OUTPut:SCAN:STOP"),
    *done("OUTPut:TRACk 0", read=("OUTPut:TRACk?", "0")),
    *done("SYSTem:MCONtrol LOC"),
)


@pytest.mark.parametrize(
    ("act", "lines"),
    [
        (
            lambda laser: laser.set_wavelength(770.5),
            (
                *done("SOURce:WAVElength 770.50", read=("SOURce:WAVElength?", "770.50")),
                *done("OUTPut:TRACk 1", read=("OUTPut:TRACk?", "1")),
                line("*OPC?", "0"),
                line("*STB?", "0"),
                line("*OPC?", "1"),
                line("*STB?", "0"),
                line("SENSe:WAVElength", "770.501"),
                *done("OUTPut:TRACk 0", read=("OUTPut:TRACk?", "0")),
            ),
        ),
        (lambda laser: laser.wavelength(), (line("SENSe:WAVElength", "770.5"),)),
        (
            lambda laser: laser.set_piezo(51.5),
            (
                line("SOURce:VOLTage:PIEZo?", "50.00"),
                *done("SOURce:VOLTage:PIEZo 51.00", read=("SOURce:VOLTage:PIEZo?", "51.00")),
                *done("SOURce:VOLTage:PIEZo 51.50", read=("SOURce:VOLTage:PIEZo?", "51.50")),
            ),
        ),
        (
            lambda laser: laser.set_current(110.0),
            done("SOURce:CURRent:DIODe 110.0", read=("SOURce:CURRent:DIODe?", "110.0")),
        ),
        (lambda laser: laser.current(), (line("SENSe:CURRent:DIODe", "109.97"),)),
        (
            lambda laser: laser.switch(True),
            (
                line("*STB?", "0"),
                line("SENSe:TEMPerature:DIODe", "20.00"),
                line("SENSe:TEMPerature:CAVity", "30.00"),
                *done("OUTPut:STATe 1"),
                line("*OPC?", "1"),
                line("*STB?", "0"),
                line("OUTPut:STATe?", "1"),
            ),
        ),
        (
            lambda laser: laser.scan_wavelength(768.0, 772.0, nm_per_s=2.0),
            (
                *REST,
                *done("SOURce:WAVE:START 768.00", read=("SOURce:WAVE:START?", "768.00")),
                *done("SOURce:WAVE:STOP 772.00", read=("SOURce:WAVE:STOP?", "772.00")),
                *done("SOURce:WAVE:SLEW:FORWard 2.00", read=("SOURce:WAVE:SLEW:FORWard?", "2.0")),
                *done("SOURce:WAVE:SLEW:RETurn 2.00", read=("SOURce:WAVE:SLEW:RETurn?", "2.0")),
                *done("SOURce:WAVE:DESSCANS 1", read=("SOURce:WAVE:DESSCANS?", "1")),
                *done("OUTPut:SCAN:RESET"),
                *done("OUTPut:SCAN:START"),
            ),
        ),
    ],
)
def test_the_exact_bytes(act, lines):
    with Transcript(*greeting(), *lines, *FAREWELL) as wire:
        with TLB6700(VisaLaserLink(wire), limits=LIMITS) as laser:
            act(laser)
        assert wire.whole


def test_a_session():
    pair = Pair(stray_every=3)
    with pair.laser() as laser:
        assert pair.instrument.remote
        assert laser.set_wavelength(768.2) == pytest.approx(768.2, abs=1e-3)
        assert pair.link.clock_s > 0.2  # the motor takes its time
        laser.set_current(130.0)
        laser.switch(True)
        assert laser.emits() and laser.current() == 130.0
        laser.set_piezo(20.0)
        told = laser.snapshot()
        assert told["piezo_set_percent"] == "20.00" and told["tracking"] == "0"
        laser.scan_wavelength(768.0, 769.0, nm_per_s=0.5)
        pair.link.sleep(0.5)
        laser.stop_scan()
        assert 768.0 <= laser.wavelength() < 769.0
    assert not pair.instrument.remote and not pair.instrument.tracking
    assert pair.instrument.output  # emission is left as it is


def test_the_piezo_never_jumps():
    pair = Pair()
    with pair.laser() as laser:
        pair.link.sent.clear()
        laser.set_piezo(7.3)
        sent = [text for text in bytes(pair.link.sent).decode().split("\r\n") if "PIEZo " in text]
        values = [50.0, *(float(text.split()[1]) for text in sent)]
        assert values[-1] == 7.3
        assert max(abs(b - a) for a, b in zip(values, values[1:], strict=False)) <= 1.0 + 1e-9


@pytest.mark.parametrize(
    "settings",
    [
        {"identity": "New_Focus 6700 v2.4 03/19/14 SN1012"},
        {"identity": "NEW_FOCUS 6700 v2.4 03/19/14 SN1012"},
        {"identity": "NEW_FOCUS, 6700, v2.4"},
        {"identity": "New Focus 6700 v1.2 11/02/10 SN7"},
        {"identity": "NewFocus TLB-6700 v2.4"},
        {"identity": "Newport 6700 v2.4 03/19/14 SN1012"},
        {"identity": "Newport New_Focus TLB-6700 v3.0"},
        {"identity": "Newport,6700,SN1012"},
        {"identity": "New_Focus 6700 v2"},
        {"identity": "6700 SN1012"},
        {"stray_ok": "before"},
        {"stray_ok": "after"},
        {"stray_ok": "after", "stray_every": 2},
        {"cut_identities": 2},
    ],
    ids=repr,
)
def test_reply_forms_of_real_controllers(settings):
    pair = Pair(**settings)
    with pair.laser() as laser:
        laser.set_piezo(48.5)
        laser.set_current(110.0)
        assert laser.piezo() == 48.5 and laser.wavelength() == 770.0
        assert laser.snapshot()["current_set_ma"] == "110.00"
        assert laser.identity == pair.instrument.identity


def test_an_ok_that_nobody_asked_for_hides_no_refusal():
    pair = Pair(stray_ok="after")
    wider = LaserLimits((700.0, 800.0), (0.0, 100.0), (30.0, 140.0), (0.0, 99.0), (0.0, 99.0))
    with pair.laser(wider) as laser:
        with pytest.raises(InstrumentError, match="VALUE OUT OF RANGE"):
            laser.set_wavelength(790.0)


@pytest.mark.parametrize("seconds", [3.0, 60.0])
def test_emission_may_be_delayed(seconds):
    pair = Pair(on_delay_s=seconds)
    with pair.laser() as laser:
        began = pair.link.clock_s
        laser.switch(True)
        assert laser.emits() and seconds <= pair.link.clock_s - began < seconds + 1.0


@pytest.mark.fault(name="emission that never comes", promise="one error")
def test_emission_that_never_comes_is_an_error():
    pair = Pair(on_delay_s=1e3)
    with (
        pair.laser() as laser,
        pytest.raises(InstrumentError, match="Emission was switched on, but is still off"),
    ):
        laser.switch(True)


@pytest.mark.fault(name="what another user switched on at the laser", promise="seen before a scan")
@pytest.mark.parametrize(
    ("left", "says"),
    [
        ("OUTPut:TRACk 1", "follows the set wavelength"),
        ("SYSTem:WINPut 1", "voltage at the rear"),
        ("OUTPut:SCAN:START", "a scan is on"),
    ],
)
def test_what_another_user_switched_on_is_seen_before_a_scan(left, says):
    pair = Pair()
    with pair.laser() as laser:
        pair.instrument.feed(left.encode() + b"\r\n")
        with pytest.raises(InstrumentError, match=says):
            laser.scan_wavelength(768.0, 769.0, nm_per_s=0.5)


def test_as_many_scans_as_asked_for():
    pair = Pair()
    with pair.laser() as laser:
        pair.instrument.feed(b"SOURce:WAVE:DESSCANS 500\r\n")
        laser.scan_wavelength(770.0, 771.0, nm_per_s=1.0, scans=2)
        assert pair.instrument.scans == 2 and laser.snapshot()["scan_option"] == "0"
        with pytest.raises(ValueError, match="1 to 9999"):
            laser.scan_wavelength(770.0, 771.0, nm_per_s=1.0, scans=0)


@pytest.mark.fault(
    name="another head, an interlock, a key, temperatures", promise="refused before anything is set"
)
@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"identity": "Newport 1830-R v1.0"}, "another instrument"),
        ({"identity": "SN1012"}, "another instrument"),
        ({"identity": "NEWPORT 1918-C v1.0 01/01/10 SN5"}, "another instrument"),
        ({"head": "TLB-6728"}, "head is another one"),
        ({"interlock": False}, "LDD INTERLOCK FLT"),
    ],
)
def test_refused_before_anything_is_set(settings, says):
    pair = Pair(**settings)
    with pytest.raises(InstrumentError, match=says):
        pair.laser()
    assert not pair.instrument.output
    assert b"STATe 1" not in pair.link.sent and b"PIEZo " not in pair.link.sent


def test_no_limits_are_refused_before_a_byte():
    pair = Pair()
    with pytest.raises(LimitError, match="no limits"):
        pair.laser(limits=None)
    assert not pair.link.sent


@pytest.mark.fault(name="settings beyond the laser's limits", promise="nothing is sent")
@pytest.mark.parametrize(
    "act",
    [
        lambda laser: laser.set_wavelength(764.9),
        lambda laser: laser.set_wavelength(float("nan")),
        lambda laser: laser.set_piezo(100.1),
        lambda laser: laser.set_current(140.1),
        lambda laser: laser.scan_wavelength(770.0, 781.5, nm_per_s=1.0),
    ],
)
def test_beyond_limits_nothing_is_sent(act):
    pair = Pair()
    with pair.laser() as laser:
        pair.link.sent.clear()
        with pytest.raises(LimitError):
            act(laser)
        assert not pair.link.sent


@pytest.mark.fault(name="the laser is too warm", promise="one error that says so")
def test_too_warm():
    pair = Pair()
    pair.instrument.cavity_c = 41.0
    with pytest.raises(InstrumentError, match="limit `cavity_c` is 20 to 40"):
        pair.laser()


@pytest.mark.fault(name="a fault of the controller", promise="ends the next setting, by its name")
@pytest.mark.parametrize(
    ("code", "says"),
    [
        (424, "cool down"),
        (501, "interlock"),
        (502, "current limit"),
        (524, "cool down"),
        (803, "cool down"),
        (804, "set to 0 %"),
    ],
)
def test_a_fault_ends_the_next_setting(code, says):
    pair = Pair()
    with pair.laser() as laser:
        laser.switch(True)
        pair.instrument.trip(code)
        with pytest.raises(InstrumentError, match=says) as failed:
            laser.set_current(100.0)
        assert str(code) in failed.value.reply


def test_the_key_is_off():
    pair = Pair(key=False)
    with pair.laser() as laser, pytest.raises(InstrumentError, match="Turn the key"):
        laser.switch(True)


@pytest.mark.fault(name="a setting that the controller refuses", promise="one error")
def test_a_setting_that_is_refused():
    pair = Pair()
    wider = LaserLimits((700.0, 800.0), (0.0, 100.0), (30.0, 140.0), (0.0, 99.0), (0.0, 99.0))
    with pair.laser(wider) as laser:
        with pytest.raises(InstrumentError, match="VALUE OUT OF RANGE"):
            laser.set_wavelength(790.0)


@pytest.mark.fault(name="a setting that the controller does not take", promise="one error")
def test_a_setting_that_is_not_taken():
    lines = done("SOURce:CURRent:DIODe 100.0", read=("SOURce:CURRent:DIODe?", "99.0"))
    with Transcript(*greeting(), *lines) as wire:
        laser = TLB6700(VisaLaserLink(wire), limits=LIMITS)
        with pytest.raises(InstrumentError, match="another setting"):
            laser.set_current(100.0)


@pytest.mark.fault(name="a motor that never arrives", promise="one error in time")
def test_a_motor_that_never_arrives():
    pair = Pair()
    with pair.laser() as laser:
        with pytest.raises(InstrumentError, match="still moving"):
            laser.set_wavelength(781.0, timeout_s=0.5)
        assert not pair.instrument.tracking


def test_limits_are_checked():
    with pytest.raises(LimitError, match="lower first"):
        LaserLimits((781.0, 765.0), (0.0, 100.0), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0))
    with pytest.raises(LimitError, match="0 to 100"):
        LaserLimits((765.0, 781.0), (0.0, 120.0), (0.0, 1.0), (0.0, 1.0), (0.0, 1.0))


@pytest.mark.parametrize("server", [TcpServer, HislipServer])
@pytest.mark.parametrize("bridged", [False, True])
def test_over_the_network(server, bridged):
    """Straight to the simulated controller, and through the bridge to another one."""
    pytest.importorskip("pyvisa_py", reason="pyvisa-py is not installed (extra `lab`)")
    import pyvisa

    pyvisa.ResourceManager("@py")
    there = SimulatedTLB6700(stray_every=3)
    served = Bridge(VisaLaserLink(SimulatedLink(there))) if bridged else there
    with server(served) as behind:
        link = VisaLaserLink(VisaLink(behind.resource, backend="@py"))
        with TLB6700(link, limits=LIMITS) as laser:
            laser.set_piezo(48.0)
            laser.switch(True)
        assert there.output and there.set["piezo"] == 48.0
