"""Generated waveforms, legal or broken in one way, and a judge without the driver's code."""

import math

import numpy as np

from hardware import AFG31000, DriveLimits, Scpi
from hardware.simulated import SimulatedAFG31052, SimulatedLink
from rapi_jax import DataError

LIMITS = DriveLimits(-1.0, 6.5, 4000.0, 0.25, 100.0)
FULL = 16382
KINDS = ("legal", "edge", "high", "low", "step", "closing", "slope", "rate", "nan", "inf", "length")


def waveform(rng, kind):
    """One period (V) and its rate (Hz); all but "legal" and "edge" are out of limits, somewhere."""
    low, high = LIMITS.low_v, LIMITS.high_v
    rate = float(rng.uniform(0.5, 90.0))
    points = int(rng.choice([2, 3, 5, 64, 129, 400]))
    angle = 2 * np.pi * np.arange(points) / points
    shape = sum(rng.normal() / k * np.sin(k * angle + rng.uniform(0, 7)) for k in (1, 2, 3))
    steepest = np.abs(np.roll(shape, -1) - shape).max() + 1e-12
    allowed = min(LIMITS.step_v, LIMITS.slew_v_per_s / (rate * points))
    most = min((high - low) / (np.ptp(shape) + 1e-12), allowed / steepest)
    wave = shape * most * rng.uniform(0.0, 0.98)
    room = high - low - np.ptp(wave)
    wave = wave - wave.min() + low + room * rng.uniform(0.01, 0.99)
    at = int(rng.integers(points))
    if kind == "edge":
        wave = np.full(points, high if rng.uniform() < 0.5 else low)
    elif kind in ("high", "low"):
        beyond = float(rng.choice([1e-6, 1e-3, 1.0, 1e6]))
        wave[at] = high + beyond if kind == "high" else low - beyond
    elif kind in ("step", "closing"):
        points = max(points, 5)
        jump = LIMITS.step_v * (1 + float(rng.choice([1e-6, 0.1, 5.0])))
        wave = np.full(points, 1.0)
        if kind == "step":
            wave[1 + at % (points - 2) :] += jump
        else:
            wave = 1.0 + jump * np.arange(points) / (points - 1)
        rate = 0.5
    elif kind == "slope":
        points, rate = 400, 90.0
        wave = np.full(points, 2.0)
        wave[1 + at % 398 :] += LIMITS.slew_v_per_s / (rate * points) * (1 + rng.uniform(1e-5, 0.5))
    elif kind == "rate":
        rate = LIMITS.max_frequency_hz * (1 + float(rng.choice([1e-6, 0.1, 1e3])))
    elif kind in ("nan", "inf"):
        wave[at] = math.nan if kind == "nan" else math.copysign(math.inf, rng.normal())
    elif kind == "length":
        wave = np.zeros(int(rng.choice([0, 1, 131073])))
    return wave, rate


def legal(wave, rate):
    """Whether every promise of `LIMITS` holds, one sample after the other round the period."""
    if not 2 <= wave.size <= 131072 or not np.isfinite(wave).all():
        return False
    slack = 1e-8 * (LIMITS.high_v - LIMITS.low_v)
    step = np.abs(np.roll(wave, -1) - wave).max()
    return bool(
        wave.min() >= LIMITS.low_v - slack
        and wave.max() <= LIMITS.high_v + slack
        and step <= LIMITS.step_v + slack
        and step * wave.size * rate <= LIMITS.slew_v_per_s * (1 + 1e-8) + slack * wave.size * rate
        and rate <= LIMITS.max_frequency_hz * (1 + 1e-8)
    )


class Generator:
    """A simulated generator behind the driver, and what has happened to it."""

    def __init__(self):
        self.instrument = SimulatedAFG31052()
        self.link = SimulatedLink(self.instrument)
        self.bytes = 0
        send = self.link.send

        def counting(data, deadline):
            self.bytes += len(data)
            send(data, deadline)

        self.link.send = counting
        self.afg = AFG31000(Scpi(self.link))
        self.channels = {n: self.afg.channel(n, limits=LIMITS) for n in (1, 2)}
        self.counts = {"played": 0, "refused": 0}

    def try_one(self, wave, rate, *, n=1, start=False):
        """Load it, and hold the driver to its promise whether it is legal or not."""
        channel, before = self.channels[n], self.bytes
        if not legal(wave, rate):
            try:
                channel.load(wave, rate)
            except DataError:
                assert self.bytes == before, "bytes were sent for a refused waveform"
                self.counts["refused"] += 1
                return
            raise AssertionError("a waveform out of limits was loaded")
        loaded = channel.load(wave, rate)
        memory = channel.read_back()
        assert memory.max() <= FULL
        code = (loaded.high_v - loaded.low_v) / FULL
        volts = loaded.low_v + memory * code
        assert np.abs(volts - wave).max() <= code
        assert volts.min() >= LIMITS.low_v - 1e-9
        assert volts.max() <= LIMITS.high_v + 1e-9
        self.counts["played"] += 1
        if start:
            channel.start()
            played = self.instrument.output(n)
            assert played is not None
            assert np.abs(played.volts - wave).max() <= code
            assert abs(played.frequency_hz - rate) <= 1e-6
            channel.off()
            assert self.instrument.output(n) is None

    def check(self):
        """What the load has felt in all of it."""
        for seen in self.instrument.seen.values():
            assert seen.low_v >= LIMITS.low_v - 1e-9
            assert seen.high_v <= LIMITS.high_v + 1e-9
            assert seen.jump_v <= LIMITS.step_v + 1e-9
            assert seen.relay_v <= 0.0041
