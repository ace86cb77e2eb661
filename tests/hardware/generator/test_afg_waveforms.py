"""No waveform out of limits reaches the wire; every legal one does, and reads back."""

import functools
import math

import hypothesis.extra.numpy as hnp
import hypothesis.strategies as st
import numpy as np
import pytest
from generated_waveforms import KINDS, LIMITS, Generator, legal, waveform
from hypothesis import example, given, settings

from hardware import AFG31000, DriveLimits, InstrumentError, Scpi
from hardware.generator._check import check_codes
from hardware.simulated import SimulatedAFG31052, SimulatedLink
from rapi_jax import AfgWaveform, DataError, LimitError, triangle


@pytest.mark.fault(
    name="waveforms out of limits: sample, step, closing step, slope, rate, NaN, Inf, length",
    promise="not a byte is sent; every legal one reads back within one code",
    trials=1500,
    seed=31,
)
@pytest.mark.slow
def test_a_few_thousand_waveforms():
    generator, rng = Generator(), np.random.default_rng(31)
    for i in range(1500):
        kind = KINDS[i % len(KINDS)]
        wave, rate = waveform(rng, kind)
        assert legal(wave, rate) == (kind in ("legal", "edge")), kind
        generator.try_one(wave, rate, n=1 + i % 2, start=i % 385 == 0)
    generator.check()
    assert generator.counts["played"] > 250
    assert generator.counts["refused"] > 1000
    assert generator.instrument.seen[1].times_on + generator.instrument.seen[2].times_on == 4


finite = st.floats(-1.5, 7.0)
points = hnp.arrays(np.float64, st.integers(2, 40), elements=finite)
small = points.map(lambda wave: 2.0 + 0.02 * wave)


@functools.cache
def shared():
    """One generator for all examples."""
    return Generator()


@settings(max_examples=150)
@given(points | small, st.floats(0.01, 120.0))
@example(np.array([2.0, 2.00900049]), 1.0)  # less than half a code beyond a level
def test_any_waveform_is_played_or_refused(wave, rate):
    before = dict(shared().counts)
    shared().try_one(wave, rate)
    kind = "played" if legal(wave, rate) else "refused"
    assert shared().counts[kind] == before.get(kind, 0) + 1


@pytest.fixture(autouse=True, scope="module")
def _checked_at_the_end():
    yield
    shared().check()


def test_a_drive_is_resampled_loaded_and_started():
    generator = Generator()
    drive = triangle(40.0, amplitude=4.5, bias=3.0)[0]
    channel = generator.channels[1]
    loaded = channel.load_drive(drive, points=2048)
    channel.start()
    played = generator.instrument.output(1)
    assert played is not None
    assert (played.codes == loaded.codes).all()
    time = (np.arange(2048) + 0.5) / 2048 / 40.0
    expected = np.interp(time, drive.time, drive.value)
    assert np.abs(played.volts - expected).max() < 4.5 / 16382
    generator.afg.close()
    assert generator.instrument.output(1) is None
    generator.check()


@pytest.mark.fault(name="a drive out of limits", promise="not a byte is sent")
def test_a_drive_out_of_limits_sends_nothing():
    generator = Generator()
    before = generator.bytes
    with pytest.raises(LimitError, match="high_v"):
        generator.channels[1].load_drive(triangle(40.0, amplitude=4.5, bias=5.0)[0])
    assert generator.bytes == before


def test_nothing_starts_that_was_not_loaded():
    generator = Generator()
    with pytest.raises(ValueError, match="call `load` first"):
        generator.channels[1].start()
    assert generator.instrument.seen[1].times_on == 0


def test_no_upload_while_the_output_is_on():
    generator = Generator()
    channel = generator.channels[1]
    channel.load(np.array([1.0, 1.1]), 10.0)
    channel.start()
    with pytest.raises(ValueError, match="call `off` first"):
        channel.load(np.array([1.0, 1.1]), 10.0)
    channel.off()


@pytest.mark.fault(
    name="another instrument, a load or a clamp that is not taken",
    promise="refused, the output never on",
)
@pytest.mark.parametrize(
    ("instrument", "words"),
    [
        (SimulatedAFG31052(identity="NewFocus 6700 v2.4"), "another instrument"),
        (
            SimulatedAFG31052(identity="TEKTRONIX,AFG31251,C1,SCPI:99.0 FV:1.6.1"),
            "another instrument",
        ),
        (SimulatedAFG31052(ignores=("OUTP1:IMP",)), "load must be inf"),
        (SimulatedAFG31052(ignores=("SOUR1:VOLT:LIM:HIGH",)), "another setting"),
        (SimulatedAFG31052(ignores=("SOUR1:VOLT:LIM:LOW",)), "another setting"),
    ],
)
def test_refused_before_output(instrument, words):
    with pytest.raises(InstrumentError, match=words):
        AFG31000(Scpi(SimulatedLink(instrument))).channel(1, limits=LIMITS)
    assert instrument.seen[1].times_on == 0


@pytest.mark.fault(name="no limits are given", promise="refused")
def test_no_limits_no_channel():
    link = SimulatedLink(SimulatedAFG31052())
    with AFG31000(Scpi(link)) as afg, pytest.raises(LimitError, match="no limits"):
        afg.channel(1, limits=None)


@pytest.mark.fault(
    name="50 ohm set between loading and starting", promise="refused, the output never on"
)
def test_someone_sets_50_ohm_between_loading_and_starting():
    instrument = SimulatedAFG31052()
    link = SimulatedLink(instrument)
    channel = AFG31000(Scpi(link)).channel(1, limits=LIMITS)
    channel.load(np.array([1.0, 1.1]), 10.0)
    instrument.feed(b"OUTP1:IMP 50\n")
    with pytest.raises(InstrumentError, match="twice its stated voltage"):
        channel.start()
    assert instrument.seen[1].times_on == 0


def test_50_ohm_into_50_ohm():
    instrument = SimulatedAFG31052(load_ohm=50.0)
    link = SimulatedLink(instrument)
    with AFG31000(Scpi(link)) as afg:
        limits = DriveLimits(-2.0, 4.0, 4000.0, 0.25, 100.0)
        with pytest.raises(LimitError, match="5 V of either sign"):
            afg.channel(2, limits=DriveLimits(0.0, 6.0, 1.0, 1.0, 1.0), load_ohm=50.0)
        channel = afg.channel(1, limits=limits, load_ohm=50.0)
        channel.load(np.array([3.9, 4.0, 3.9, 3.8]), 10.0)
        channel.start()
    assert instrument.seen[1].high_v == pytest.approx(4.0)
    assert instrument.seen[1].relay_v < 0.005


def test_levels_that_the_instrument_rounds_are_those_of_the_codes():
    generator = Generator()
    wave = np.linspace(1.23456, 1.27777, 50)
    wave = np.concatenate([wave, wave[::-1]])
    loaded = generator.channels[1].load(wave, 10.0)
    assert (loaded.low_v, loaded.high_v) == (1.234, 1.278)
    assert loaded.codes[0] == round((1.23456 - 1.234) / 0.044 * 16382)


@pytest.mark.fault(
    name="an instrument that rounds its levels more coarsely",
    promise="refused, the output never on",
)
def test_an_instrument_that_rounds_more_coarsely_is_refused():
    instrument = SimulatedAFG31052(digits=2)
    limits = DriveLimits(0.0, 7.5, 4000.0, 0.5, 100.0)
    with AFG31000(Scpi(SimulatedLink(instrument))) as afg:
        channel = afg.channel(1, limits=limits)
        with pytest.raises(InstrumentError, match="another setting"):
            channel.load(np.array([1.26, 1.74]), 10.0)
    assert instrument.seen[1].times_on == 0


@pytest.mark.parametrize("clamp", [(5.0, 7.0), (-10.0, 10.0), (-9.0, -3.0), (0.0, 2.0)])
def test_whatever_was_set_before_the_new_clamp_is_reached_legally(clamp):
    low, high = clamp
    instrument = SimulatedAFG31052()
    instrument.feed(b"OUTP1:IMP INF\nSOUR1:VOLT:HIGH 10\nSOUR1:VOLT:LOW -10\n")
    instrument.feed(b"SOUR1:VOLT:HIGH %g\n" % high if high < 0 else b"SOUR1:VOLT:LOW %g\n" % low)
    instrument.feed(b"SOUR1:VOLT:HIGH %g;:SOUR1:VOLT:LOW %g\n" % (high, low))
    instrument.feed(b"SOUR1:VOLT:LIM:HIGH %g;:SOUR1:VOLT:LIM:LOW %g\n*CLS\n" % (high, low))
    with AFG31000(Scpi(SimulatedLink(instrument))) as afg:
        afg.channel(1, limits=LIMITS)
    answers = instrument.feed(b"SOUR1:VOLT:LIM:HIGH?\nSOUR1:VOLT:LIM:LOW?\n")
    assert [float(a.data) for a in answers] == [LIMITS.high_v, LIMITS.low_v]


@pytest.mark.fault(name="an output that was left on", promise="parked and off")
def test_an_output_that_was_left_on_is_parked_and_switched_off():
    instrument = SimulatedAFG31052()
    instrument.feed(b"OUTP1:IMP INF;:SOUR1:VOLT:HIGH 5;:SOUR1:VOLT:LOW 4;:OUTP1 ON\n")
    instrument.seen[1].relay_v = 0.0
    with AFG31000(Scpi(SimulatedLink(instrument))) as afg:
        afg.channel(1, limits=LIMITS)
        assert instrument.output(1) is None
    assert instrument.seen[1].relay_v < 0.005


def test_a_second_user_of_a_channel_is_refused():
    with AFG31000(Scpi(SimulatedLink(SimulatedAFG31052()))) as afg:
        afg.channel(1, limits=LIMITS)
        with pytest.raises(ValueError, match="in use"):
            afg.channel(1, limits=LIMITS)
        with pytest.raises(ValueError, match="must be 1 or 2"):
            afg.channel(3, limits=LIMITS)


@pytest.mark.fault(name="a rate that is none", promise="refused")
@pytest.mark.parametrize("rate", [0.0, -1.0, math.nan, math.inf, 1e-7])
def test_a_rate_that_cannot_be_is_refused(rate):
    generator = Generator()
    before = generator.bytes
    with pytest.raises(DataError):
        generator.channels[1].load(np.array([1.0, 1.1]), rate)
    assert generator.bytes == before


@pytest.mark.parametrize("points", [400, 4000, 131072])
def test_a_waveform_in_codes_is_judged_by_the_drive_it_stands_for(points):
    generator = Generator()
    steepest = 2 * 40.0 * 4.5  # V/s, of the triangle below
    channel = generator.channels[1]
    wave = AfgWaveform.of(triangle(40.0, amplitude=4.5, bias=3.0)[0], points)
    loaded = channel.load_waveform(wave)
    assert (channel.read_back() == loaded.codes).all()
    assert np.abs(loaded.volts - wave.volts).max() <= 4.5 / 16382
    tight = DriveLimits(0.0, 6.5, steepest * 1.001, 1.0, 100.0)
    check_codes(wave, tight)
    for slew, step in ((steepest * 0.99, 1.0), (1e9, 2 * 4.5 / points * 0.9)):
        with pytest.raises(LimitError, match="changes by more than"):
            check_codes(wave, DriveLimits(0.0, 6.5, slew, step, 100.0))
    with pytest.raises(LimitError, match="high_v"):
        check_codes(wave, DriveLimits(0.0, 5.0, 1e9, 1.0, 100.0))


@pytest.mark.fault(name="one code of a waveform out of line", promise="refused whole")
@pytest.mark.parametrize("at", [0, 1, 200, 398, 399])
def test_one_code_out_of_line_is_refused(at):
    codes = np.full(400, 8000)
    codes[at] += 60  # the limit allows 0.111 V a sample
    wave = AfgWaveform(codes, 0.0, 6.0, 90.0)
    assert (check_codes(wave, LIMITS) == wave.volts).all()
    codes[at] += 400
    generator = Generator()
    before = generator.bytes
    with pytest.raises(LimitError, match=f"sample {at} "):
        generator.channels[1].load_waveform(AfgWaveform(codes, 0.0, 6.0, 90.0))
    assert generator.bytes == before


@pytest.mark.fault(name="codes that fall, or rise, too fast once a period", promise="refused whole")
@pytest.mark.parametrize("falls", [True, False])
def test_one_edge_in_one_direction_is_refused(falls):
    """The way back is slow: an edge is looked at whichever way it goes."""
    for height, good in ((200, True), (800, False)):  # the limit allows 303 codes a sample
        codes = 8000 + np.arange(400) * height // 400
        wave = AfgWaveform(codes if falls else codes[::-1].copy(), 0.0, 6.0, 90.0)
        if good:
            assert (check_codes(wave, LIMITS) == wave.volts).all()
            continue
        with pytest.raises(LimitError, match="changes by more than"):
            check_codes(wave, LIMITS)
