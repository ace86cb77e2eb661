"""Each fault of a peer or a user, and what becomes of the output: parked, off, and said in time."""

import numpy as np
import pytest

from hardware import AFG31000, DriveLimits, InstrumentError, Scpi
from hardware.simulated import (
    Closing,
    Cut,
    Endless,
    Faulty,
    Instead,
    Silent,
    SimulatedAFG31052,
    SimulatedLink,
    Slow,
    Unplugged,
)

LIMITS = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
WAVE = np.array([1.0, 1.2, 1.4, 1.2])
TIMEOUT_S = 1.0

FAULTS = {
    "silent": Silent(),
    "too slow": Slow(1.5),
    "byte by byte": Slow(0.6, pieces=1),
    "closing": Closing(),
    "closing half-way": Closing(3),
    "half an answer": Cut(1),
    "endless": Endless(),
    "endless and slow": Endless(b"x", 0.1),
    "a lying block header": Instead(b"#6999999\x00\x00"),
    "an answer to something else": Instead(b"TEKTRONIX,TDS210,0,CF:91.1CT\n"),
    "an entry of the error queue": Instead(b'-222,"Data out of range"\n'),
    "terminal codes": Instead(b"\x1b[2J\x07\n"),
}
PLACES = {
    "identity": b"*IDN?",
    "load": b"OUTP1:IMP?",
    "clamp": b"LIM:HIGH?",
    "levels": b"IMM:HIGH?",
    "points": b"DATA:POIN?",
    "read back": b"DATA:DATA?",
    "error queue": b"SYST:ERR?",
}


@pytest.mark.fault(
    name="an answer late, cut, endless, lying or none, at each query before the output is on",
    promise="one error within twice the deadline, the output never on",
)
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("fault", FAULTS)
def test_before_output_every_fault_ends_in_one_error_and_the_output_was_never_on(fault, place):
    instrument = SimulatedAFG31052()
    peer = Faulty(instrument, FAULTS[fault], when=PLACES[place])
    link = SimulatedLink(peer, per_byte_s=1e-7)
    session = Scpi(link, timeout_s=TIMEOUT_S)
    began = 0.0

    def steps():
        afg = AFG31000(session)
        yield
        channel = afg.channel(1, limits=LIMITS)
        yield
        channel.load(WAVE, 10.0)
        yield
        channel.read_back()
        yield

    with pytest.raises(InstrumentError) as caught:
        for _ in steps():
            began = link.now()
    assert link.now() - began <= 2 * TIMEOUT_S
    assert str(caught.value).isprintable()
    assert instrument.seen[1].times_on == 0


@pytest.mark.fault(
    name="an answer late, cut, endless, lying or none while the output is on",
    promise="one error in time, parked and off, the relay moves below 5 mV",
)
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_while_the_output_is_on_leaves_it_parked_and_off(fault):
    instrument = SimulatedAFG31052()
    peer = Faulty(instrument, FAULTS[fault], when=b"DATA:DATA?", times=1)
    link = SimulatedLink(peer, per_byte_s=1e-7)
    with pytest.raises(InstrumentError), AFG31000(Scpi(link, timeout_s=TIMEOUT_S)) as afg:
        channel = afg.channel(1, limits=LIMITS)
        channel.load(WAVE, 10.0)
        channel.start()
        began = link.now()
        channel.read_back()
    assert link.now() - began < 2 * TIMEOUT_S  # the ramp in it
    assert instrument.output(1) is None
    assert instrument.seen[1].relay_v <= 0.004 + 1e-9
    assert instrument.seen[1].high_v <= 1.4 + 1e-9


@pytest.mark.fault(
    name="an answer late, cut, endless, lying or none while the output is switched on",
    promise="off",
)
@pytest.mark.parametrize("place", [b"STAT ON", b"STAT?", b"IMM:HIGH", b"*ESR?"])
@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_while_starting_leaves_it_off(fault, place):
    instrument = SimulatedAFG31052()
    peer = Faulty(instrument, FAULTS[fault], when=b"never")
    link = SimulatedLink(peer, per_byte_s=1e-7)
    afg = AFG31000(Scpi(link, timeout_s=TIMEOUT_S))
    channel = afg.channel(1, limits=LIMITS)
    channel.load(WAVE, 10.0)
    peer._when, peer._times, peer._left = place, 1, 3 if place == b"IMM:HIGH" else 0
    try:
        channel.start()
    except InstrumentError:
        assert not channel.on
        assert instrument.output(1) is None
    else:  # the fault struck a command, which has no answer to spoil
        channel.off()
    assert instrument.output(1) is None
    assert instrument.seen[1].relay_v <= 0.0041
    assert instrument.seen[1].high_v <= 1.4 + 1e-9


@pytest.mark.fault(
    name="the connection is lost in an upload, or the peer stops reading",
    promise="one error in time, the output never on",
)
@pytest.mark.parametrize("deaf", [False, True])
@pytest.mark.parametrize("taken", [1, 300, 5000, 200_000])
def test_connection_lost_during_an_upload(taken, deaf):
    instrument = SimulatedAFG31052()
    peer = Unplugged(instrument, 1 << 40, deaf=deaf)
    link = SimulatedLink(peer, per_byte_s=1e-7)
    afg = AFG31000(Scpi(link, timeout_s=TIMEOUT_S))
    channel = afg.channel(1, limits=LIMITS)
    peer._left = 1000 + taken  # what goes before the upload is shorter
    wave = 1.0 + 0.2 * np.sin(2 * np.pi * np.arange(131072) / 131072)
    began = link.now()
    with pytest.raises(InstrumentError):
        channel.load(wave, 10.0)
    assert link.now() - began <= 2 * (TIMEOUT_S + 2 * wave.size / 5e4)
    assert channel.loaded is None
    with pytest.raises(ValueError, match="no waveform"):
        channel.start()
    afg.close()  # nothing to switch off, so nothing to complain about
    assert instrument.seen[1].times_on == 0


@pytest.mark.fault(name="a block that is half written", promise="cured by connecting again")
def test_a_half_written_block_is_cured_by_connecting_again():
    instrument = SimulatedAFG31052()
    peer = Unplugged(instrument, 1 << 40, comes_back=True)
    link = SimulatedLink(peer)
    afg = AFG31000(Scpi(link, timeout_s=TIMEOUT_S))
    channel = afg.channel(1, limits=LIMITS)
    wave = 1.0 + 0.2 * np.sin(2 * np.pi * np.arange(20_000) / 20_000)
    peer._left = 9000
    with pytest.raises(InstrumentError):
        channel.load(wave, 10.0)
    channel.load(wave, 10.0)  # asked for anew, by the user
    assert channel.read_back().size == 20_000
    channel.start()
    afg.close()
    assert link.connections == 2
    assert instrument.output(1) is None


@pytest.mark.fault(
    name="the instrument cannot be reached while the output is on",
    promise="the error says that the output may still be on",
)
def test_where_the_output_cannot_be_reached_the_error_says_that_it_may_be_on():
    instrument = SimulatedAFG31052()
    peer = Unplugged(instrument, 1 << 40)
    link = SimulatedLink(peer, per_byte_s=1e-7)
    afg = AFG31000(Scpi(link, timeout_s=TIMEOUT_S))
    channel = afg.channel(1, limits=LIMITS)
    channel.load(WAVE, 10.0)
    channel.start()
    peer._left = 0
    began = link.now()
    with pytest.raises(InstrumentError, match="MAY STILL BE ON"):
        afg.close()
    assert link.now() - began <= 2 * TIMEOUT_S
    assert channel.on
    peer._left = 1 << 40
    peer._gone = False
    channel.off()  # plugged in again: the same exit now works
    assert instrument.output(1) is None


@pytest.mark.fault(
    name="an exception or interrupt with both outputs on", promise="both parked and off"
)
@pytest.mark.parametrize("error", [ZeroDivisionError, KeyboardInterrupt, SystemExit])
def test_any_exception_parks_both_outputs(error):
    instrument = SimulatedAFG31052()
    link = SimulatedLink(instrument)
    with pytest.raises(error), AFG31000(Scpi(link)) as afg:
        for n in (1, 2):
            channel = afg.channel(n, limits=LIMITS)
            channel.load(WAVE + 0.1 * n, 10.0)
            channel.start()
        assert instrument.output(2) is not None
        raise error
    for n in (1, 2):
        assert instrument.output(n) is None
        assert instrument.seen[n].times_on == 1
        assert instrument.seen[n].relay_v <= 0.0041
        assert instrument.seen[n].jump_v <= 0.05 + 1e-3


class Interrupting(SimulatedLink):
    """Control-C in the midst of something."""

    strike_at = b"never"

    def send(self, data: bytes, deadline: float) -> None:
        super().send(data, deadline)
        if self.strike_at in data:
            self.strike_at = b"never"
            raise KeyboardInterrupt


@pytest.mark.fault(name="an interrupt while the levels are ramped out", promise="parked and off")
@pytest.mark.parametrize("place", [b"STAT ON", b"IMM:HIGH 0.9", b"IMM:LOW 0.5"])
def test_an_interrupt_while_ramping_out_switches_off(place):
    instrument = SimulatedAFG31052()
    link = Interrupting(instrument)
    afg = AFG31000(Scpi(link))
    channel = afg.channel(1, limits=LIMITS)
    channel.load(WAVE, 10.0)
    link.strike_at = place
    with pytest.raises(KeyboardInterrupt):
        channel.start()
    assert instrument.output(1) is None
    assert instrument.seen[1].times_on == 1
    assert instrument.seen[1].relay_v <= 0.0041


@pytest.mark.fault(name="a second interrupt, while parking", promise="off at once")
def test_an_interrupt_while_parking_switches_off_at_once():
    instrument = SimulatedAFG31052()
    link = Interrupting(instrument)
    afg = AFG31000(Scpi(link))
    channel = afg.channel(1, limits=LIMITS)
    channel.load(WAVE, 10.0)
    channel.start()
    link.strike_at = b"IMM:HIGH 1.0"
    with pytest.raises(KeyboardInterrupt):
        afg.close()
    assert instrument.output(1) is None
    assert not channel.on


def test_a_busy_instrument_is_waited_for():
    link = SimulatedLink(SimulatedAFG31052(upload_s=0.8))
    with AFG31000(Scpi(link, timeout_s=TIMEOUT_S)) as afg:
        channel = afg.channel(1, limits=LIMITS)
        channel.load(WAVE, 10.0)
        assert link.clock_s >= 0.8
    link = SimulatedLink(SimulatedAFG31052(upload_s=1.5))
    with AFG31000(Scpi(link, timeout_s=TIMEOUT_S)) as afg:
        channel = afg.channel(1, limits=LIMITS)
        with pytest.raises(InstrumentError, match="busy"):
            channel.load(WAVE, 10.0)


def test_ramps_keep_to_the_slew():
    limits = DriveLimits(0.0, 7.5, 0.5, 0.5, 1.0)
    link = SimulatedLink(SimulatedAFG31052())
    with AFG31000(Scpi(link)) as afg:
        channel = afg.channel(1, limits=limits)
        channel.load(np.full(10, 2.0), 0.1)
        began = link.clock_s
        channel.start()
        assert link.clock_s - began == pytest.approx(2.0 / 0.5, rel=0.02)
