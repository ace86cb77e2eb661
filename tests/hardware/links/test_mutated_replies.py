"""Replies of each instrument, one of a session damaged at random: taken as it is right, or refused.

A few of each here; `RAPI_MUTATIONS=10000` tries as many.
"""

import random

import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import given, settings
from mutations import mutated, trials

from hardware import (
    AFG31000,
    TLB6700,
    Acquisition,
    DriveLimits,
    InfiniiVision,
    Input,
    InstrumentError,
    LaserLimits,
    Scpi,
    VisaLaserLink,
)
from hardware.links import _reply
from hardware.servers._instrument import AbstractInstrument, Answer
from hardware.simulated import (
    Clock,
    SimulatedAFG31052,
    SimulatedInfiniiVision,
    SimulatedLink,
    SimulatedTLB6700,
)
from rapi_jax import DataError, LimitError

LIMITS = DriveLimits(0.5, 3.0, 4000.0, 0.5, 100.0)
WAVE = np.array([1.0, 1.2, 1.4, 1.2])
ASKED = Acquisition({"interferometer": Input(1, -0.2, 1.2)}, before_s=1e-4, after_s=1e-3)
LASER = LaserLimits(
    wavelength_nm=(765.0, 781.0),
    piezo_percent=(0.0, 100.0),
    current_ma=(30.0, 140.0),
    diode_c=(15.0, 30.0),
    cavity_c=(20.0, 40.0),
)
SUFFIXES = (b"V", b" V", b"HZ", b"OHM", b"mV", b"%", b";1", b",0", b"E5", b"\r", b" ", b"\x00")
FEW = {"generator": 8, "oscilloscope": 12, "laser": 40}
LONGEST_S = 60.0  # of a session on its own clock: a dozen deadlines at most


class OneDamaged(AbstractInstrument):
    """An instrument whose answer number `which` is damaged."""

    def __init__(self, instrument, which, rng):
        self.instrument, self.answers = instrument, 0
        self._which, self._rng = which, rng

    def splitter(self):
        return self.instrument.splitter()

    def connected(self):
        self.instrument.connected()

    def feed(self, data):
        for answer in self.instrument.feed(data):
            self.answers += 1
            hit = self.answers - 1 == self._which
            yield Answer(damaged(answer.data, self._rng), answer.after_s) if hit else answer


def damaged(reply, rng):
    """A reply cut, with another unit, of random bytes, doubled, or with a few changes."""
    end = b"\r" if reply.endswith(b"\r") else b"\n"
    body = reply.removesuffix(end)
    way = rng.randrange(6)
    if way == 0:
        return body[: rng.randrange(len(body) + 1)] + end * rng.randrange(2)
    if way == 1:
        return body + rng.choice(SUFFIXES) + end
    if way == 2:
        return rng.randbytes(rng.randrange(80)) + end
    if way == 3:
        return rng.choice((b"OK", b"+", b"0", body, b"1")) + end + body + end
    return mutated(reply, rng)[: 1 << 16]


def generator_session(peer, clock):
    """Loads, plays and parks; the voltages at the output are judged whatever is said."""
    link = SimulatedLink(peer, clock=clock)
    with AFG31000(Scpi(link, timeout_s=1.0)) as afg:
        channel = afg.channel(1, limits=LIMITS)
        channel.load(WAVE, 10.0)
        channel.start()
        played = peer.instrument.output(1)
        assert (played.codes == channel.loaded.codes).all() and played.frequency_hz == 10.0
        assert (played.low_v, played.high_v) == (1.0, 1.4)
        channel.settings()


def oscilloscope_session(peer, clock):
    """One record; where it is given, it is the ramp that was there."""
    with InfiniiVision(Scpi(SimulatedLink(peer, clock=clock))) as scope:
        scope.configure(ASKED)
        scope.arm()
        samples = scope.fetch(1.0).check(ASKED)
        volts = samples.volts("interferometer")
        time = samples.start_s + np.arange(volts.size) / samples.sample_hz
        assert np.isfinite(volts).all() and np.isfinite(time).all()


def laser_session(peer, clock):
    """Set, looked at, and left."""
    with TLB6700(VisaLaserLink(SimulatedLink(peer, clock=clock)), limits=LASER) as laser:
        laser.set_piezo(50.0)
        laser.check()
        laser.settings()
    assert peer.instrument.set["piezo"] == 50.0


def ramp(now_s, first_s, count, sample_hz):
    return {1: 0.5 + 100.0 * (first_s + np.arange(count) / sample_hz)}


SESSIONS = {
    "generator": (generator_session, lambda clock: SimulatedAFG31052(clock=clock)),
    "oscilloscope": (oscilloscope_session, lambda clock: SimulatedInfiniiVision(ramp, clock=clock)),
    "laser": (laser_session, lambda clock: SimulatedTLB6700(clock=clock, emits=True)),
}


def play(kind, which, rng):
    """A session with its reply number `which` damaged; how many replies it had, and its error."""
    act, make = SESSIONS[kind]
    clock = Clock()
    peer = OneDamaged(make(clock), which, rng)
    error = None
    try:
        act(peer, clock)
    except (InstrumentError, DataError, LimitError) as caught:
        error = caught
    assert clock.s < LONGEST_S
    return peer, error


@pytest.mark.fault(
    name=lambda kind: f"a reply of the {kind} damaged at random",
    promise="the right value or one error in time; no voltage beyond the limits, the output off",
    trials=lambda kind: trials(FEW[kind]),
    seed="its kind",
)
@pytest.mark.parametrize("kind", SESSIONS)
def test_a_damaged_reply_is_taken_as_it_is_right_or_refused(kind):
    whole, error = play(kind, -1, random.Random(0))
    assert error is None
    rng, refused = random.Random(kind), 0
    for trial in range(trials(FEW[kind])):
        peer, error = play(kind, rng.randrange(whole.answers), rng)
        if error is not None:
            refused += 1
            said = str(error)
            assert said.isprintable() and 0 < len(said) < 1500, (trial, said)
        if kind == "generator":
            seen, on = peer.instrument.seen[1], peer.instrument.output(1) is not None
            assert not on or "MAY STILL BE ON" in str(error), (trial, error)
            assert seen.low_v >= 0.5 - 1e-9 and seen.high_v <= 3.0 + 1e-9, (trial, seen)
    assert refused > trials(FEW[kind]) // 4


@settings(max_examples=200)
@given(st.floats(-1e30, 1e30), st.sampled_from(["V", "mV", "HZ", " V", "OHM", "%", "E", "e5V"]))
def test_a_number_with_a_unit_behind_it_is_none(value, suffix):
    """Nor is the number then taken without it: `500mV` would be 500 V."""
    with pytest.raises(ValueError, match="not a number"):
        _reply.number(f"{value:.6E}{suffix}")
