"""Scans of a simulated session: the drive as a function of time, known between its samples too."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
RATES = (5.0, 7.0, 8.0, 10.0, 12.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 50.0, 60.0, 70.0, 80.0)
SAMPLES = (200, 225, 256, 300, 320, 360, 400, 500)


@dataclass(frozen=True, eq=False)
class Scan:
    """One run's periodic drive in V.

    `phase` is the fraction of a period that has passed since the drive's minimum when the first
    sample is taken. `table` holds one period of any other drive, in V, equally spaced from phase 0
    on; between its entries the drive is a straight line.
    """

    rate_hz: float
    swing: float  # V, peak to peak
    bias: float  # V, half way between the extremes
    waveform: str  # triangle, sine, other
    periods: int
    samples: int  # a period
    phase: float = 0.0
    start_s: float = 0.0  # of the first sample, on the session's clock
    table: Array | None = None

    @property
    def step_s(self) -> float:
        """Time between samples, s."""
        return 1 / (self.rate_hz * self.samples)

    @property
    def duration_s(self) -> float:
        """From the first sample to one step after the last, s."""
        return self.periods / self.rate_hz

    @cached_property
    def time_s(self) -> Array:
        """Sample times from 0, s."""
        return np.arange(self.periods * self.samples, dtype=float) * self.step_s

    @cached_property
    def drive(self) -> Array:
        """The drive at the samples, V."""
        return self.voltage(self.time_s)

    def voltage(self, t: Array) -> Array:
        """The drive in V at any times `t` in s from the first sample, negative ones included."""
        place = np.mod(self.rate_hz * t + self.phase, 1.0)
        if self.table is not None:
            closed = np.append(self.table, self.table[0])
            return np.interp(place * len(self.table), np.arange(len(closed)), closed)
        if self.waveform == "triangle":
            return self.bias + self.swing * (0.5 - np.abs(2 * place - 1))
        if self.waveform == "sine":
            return self.bias - self.swing / 2 * np.cos(2 * np.pi * place)
        raise ValueError(
            f"Argument `waveform` is {self.waveform!r}, but only triangle and sine need no table. "
            "Give one period of the drive to `sampled`."
        )


def scan_from_samples(
    volts: Array, rate_hz: float, *, periods: int = 5, start_s: float = 0.0, waveform: str = "other"
) -> Scan:
    """A scan that repeats `volts`, one period of equally spaced values in V."""
    low, high = float(np.min(volts)), float(np.max(volts))
    return Scan(
        rate_hz=rate_hz,
        swing=high - low,
        bias=(high + low) / 2,
        waveform=waveform,
        periods=periods,
        samples=len(volts),
        start_s=start_s,
        table=np.array(volts, dtype=float),
    )


def place_in_time(
    scans: Sequence[Scan], begin_s: float, *, pause_s: float = 2.0
) -> tuple[Scan, ...]:
    """The same scans one after the other from `begin_s` on, with pauses between them."""
    out = []
    for scan in scans:
        out.append(replace(scan, start_s=begin_s))
        begin_s += scan.duration_s + pause_s
    return tuple(out)


def draw_scans(rng: np.random.Generator) -> tuple[Scan, ...]:
    """Six to nine runs on one clock: at least four rates at the full swing, two or three swings.

    Triangles mostly, one or two sines. In one of three sessions the corners lie off the
    sampling grid, in one of three a run of small swing has another bias.
    """
    count = int(rng.integers(6, 10))
    rates = _draw_rates(rng, count)
    bias = float(rng.uniform(2.9, 3.1))
    full = float(rng.uniform(4.0, 4.8))
    swings = [full, full * float(rng.uniform(0.55, 0.75)), full * float(rng.uniform(0.35, 0.5))]
    swings = swings[: int(rng.integers(2, 4))]
    small = int(rng.integers(2, count - 3))
    chosen = [swings[1 + k % (len(swings) - 1)] if k < small else full for k in range(count)]
    sines = set(rng.choice(count, size=int(rng.integers(1, 3)), replace=False).tolist())
    shifted = rng.random() < 1 / 3
    off_grid = rng.random() < 1 / 3
    phase = float(rng.choice([0.0, 0.25]))
    clock = float(rng.uniform(1.0, 5.0))
    scans = []
    for k in rng.permutation(count).tolist():
        samples = int(rng.choice(SAMPLES))
        scan = Scan(
            rate_hz=rates[k],
            swing=chosen[k],
            bias=bias + (float(rng.choice([-0.5, 0.5])) if shifted and k == small - 1 else 0.0),
            waveform="sine" if k in sines else "triangle",
            periods=int(rng.integers(4, 7)),
            samples=samples,
            phase=phase + (float(rng.uniform(0.1, 0.9)) / samples if off_grid else 0.0),
            start_s=round(clock, 3),
        )
        scans.append(scan)
        clock += scan.duration_s + float(np.exp(rng.uniform(np.log(0.5), np.log(20.0))))
    return tuple(scans)


def _draw_rates(rng: np.random.Generator, count: int) -> list[float]:
    """Rates in Hz, one per run: four differ at the full swing, and a small swing repeats one."""
    while True:
        rates = rng.choice(RATES, size=count, replace=True).astype(float)
        full = rates[-4:]
        if len(set(full.tolist())) == 4 and full.max() / full.min() >= 3 and full.max() >= 30:
            rates[0] = full[0]
            return rates.tolist()
