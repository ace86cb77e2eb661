"""The oscilloscope as a digitizer: what it is told, what comes back, on which clock."""

import numpy as np
import pytest

from hardware import Acquisition, InfiniiVision, Input, InstrumentError, Scpi
from hardware.simulated import Clock, Faulty, Instead, SimulatedInfiniiVision, SimulatedLink
from rapi_jax import DataError

INPUTS = {"interferometer": Input(1, -0.2, 1.2), "cavity": Input(2, -0.5, 0.5)}
ASKED = Acquisition(INPUTS, before_s=1e-4, after_s=2e-3, sample_hz=5e6)


class Bench:
    """An oscilloscope that sees a ramp and a tone about each trigger."""

    def __init__(self, *, playing=True, **settings):
        self.clock = Clock()
        self.playing = playing
        self.instrument = SimulatedInfiniiVision(self.light, clock=self.clock, **settings)
        self.scope = InfiniiVision(Scpi(SimulatedLink(self.instrument, clock=self.clock)))

    def light(self, now_s, first_s, count, sample_hz):
        if not self.playing:
            return None
        time = first_s + np.arange(count) / sample_hz
        return {1: 0.5 + 100.0 * time, 2: 0.3 * np.sin(2e4 * time)}


def test_a_record():
    bench = Bench()
    with bench.scope as scope:
        scope.configure(ASKED)
        for _ in range(2):
            scope.arm()
            samples = scope.fetch(1.0).check(ASKED)
        time = samples.start_s + np.arange(samples.codes["cavity"].size) / samples.sample_hz
        assert time[0] <= -1e-4 and time[-1] >= 2e-3 - 1 / samples.sample_hz
        assert samples.sample_hz >= 5e6
        for name, volts in (
            ("interferometer", 0.5 + 100.0 * time),
            ("cavity", 0.3 * np.sin(2e4 * time)),
        ):
            step = (INPUTS[name].high_v - INPUTS[name].low_v) / 4095
            assert np.abs(samples.volts(name) - volts).max() <= 0.51 * step
        told = scope.snapshot()
        assert float(told["ACQ:SRAT"]) == samples.sample_hz


@pytest.mark.fault(name="no trigger comes", promise="one error in time")
def test_no_trigger():
    bench = Bench(playing=False)
    bench.scope.configure(ASKED)
    bench.scope.arm()
    began = bench.clock.s
    with pytest.raises(InstrumentError, match="No trigger came within 0.5 s"):
        bench.scope.fetch(0.5)
    assert bench.clock.s - began < 1.0


@pytest.mark.fault(name="a memory that is too short", promise="refused")
def test_a_memory_that_is_too_short():
    bench = Bench(memory=4000)
    bench.scope.configure(ASKED)
    bench.scope.arm()
    with pytest.raises(DataError, match="needs 5e\\+06"):
        bench.scope.fetch(1.0).check(ASKED)


@pytest.mark.fault(name="another instrument at the oscilloscope's address", promise="refused")
def test_another_instrument():
    with pytest.raises(InstrumentError, match="another instrument"):
        Bench(identity="KEYSIGHT TECHNOLOGIES,33600A,MY1,1.0")


@pytest.mark.fault(name="a record's description that is none", promise="one error")
@pytest.mark.parametrize(
    "data",
    [
        b"+1,+0,+10\n",
        b"1,0,0,1,1e-8,0,0,1e-3,0,0\n",
        b"1,0,100,1,-1,0,0,1e-3,0,0\n",
        b"1,0,100,,1e-8,0,0,1e-3,0,0\n",
        b"1,0,100,1,1e-8,0,0,1e,0,0\n",
        b"1,0,100,1,1.0.8,0,0,1e-3,0,0\n",
        b"1,0,100,1,1e-8,0,0,9.9E+37,0,0\n",
        b"1,0,100,1,1e-8,0,0,1e999,0,0\n",
    ],
)
def test_a_description_that_is_none(data):
    bench = Bench()
    faulty = Faulty(bench.instrument, Instead(data), when=b":WAV:PRE?")
    scope = InfiniiVision(Scpi(SimulatedLink(faulty, clock=bench.clock)))
    scope.configure(ASKED)
    scope.arm()
    with pytest.raises(InstrumentError, match="description"):
        scope.fetch(1.0)


@pytest.mark.fault(name="a status of the oscilloscope that is none", promise="one error")
@pytest.mark.parametrize("data", [b"9.9E+37\n", b"nan\n", b"-8\n", b"8,8\n", b"999999\n"])
def test_a_status_that_is_none(data):
    bench = Bench()
    faulty = Faulty(bench.instrument, Instead(data), when=b":OPER:COND?")
    scope = InfiniiVision(Scpi(SimulatedLink(faulty, clock=bench.clock)))
    scope.configure(ASKED)
    scope.arm()
    with pytest.raises(InstrumentError, match="OPER:COND"):
        scope.fetch(1.0)


@pytest.mark.fault(name="a block of another size than the record", promise="one error")
@pytest.mark.parametrize("data", [b"#210" + b"\0" * 10 + b"\n", b"#8" + b"9" * 8 + b"\n"])
def test_a_block_of_another_size(data):
    bench = Bench()
    faulty = Faulty(bench.instrument, Instead(data), when=b":WAV:DATA?")
    scope = InfiniiVision(Scpi(SimulatedLink(faulty, clock=bench.clock)))
    scope.configure(ASKED)
    scope.arm()
    with pytest.raises(InstrumentError, match="must have"):
        scope.fetch(1.0)


def test_a_setting_that_is_out_of_range():
    bench = Bench()
    wide = Acquisition({"interferometer": Input(1, -50.0, 50.0)}, 0.0, 1e-3)
    with pytest.raises(InstrumentError, match="-222"):
        bench.scope.configure(wide)


def test_first_it_is_configured():
    with pytest.raises(ValueError, match="call `configure` first"):
        Bench().scope.arm()


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"inputs": {}}, "at least one"),
        ({"inputs": {"a": Input(1, 0.0, 1.0), "b": Input(1, 0.0, 1.0)}}, "each of them once"),
        ({"before_s": -1.0}, "not be negative"),
        ({"sample_hz": 0.0}, "must be positive"),
    ],
)
def test_an_acquisition_that_is_none(settings, says):
    usual = {"inputs": INPUTS, "before_s": 0.0, "after_s": 1e-3}
    with pytest.raises(DataError, match=says):
        Acquisition(**(usual | settings))
    with pytest.raises(DataError, match="must lie below"):
        Input(1, 1.0, 0.0)
