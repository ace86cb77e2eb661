"""What a simulated generator's output plays: polarity, phase, sweep, burst and modulation."""

import dataclasses
import math

import numpy as np

from rapi_jax import AfgWaveform
from rapi_jax.internal import FULL, POINTS

MODULATIONS = ("AM", "FM", "PM", "FSK", "PWM")


@dataclasses.dataclass
class Playback:
    """How a channel plays its waveform, beside its levels; the defaults play it as it is.

    - `frequency_hz`: of the waveform. `symmetry`: share of a ramp that rises; `duty`: share of a
      pulse that is high. `inverted`: the output's polarity. `phase_rad`: at the
      trigger. `mode`: "CW" or "SWE" (a sweep from `sweep_from_hz` to `sweep_to_hz` in `sweep_s`).
    - `modulation`: those of `MODULATIONS` that are on, with a sine or square of `modulation_hz`.
      `am_depth`: 0 to 1. `fm_hz`, `pm_rad`: deviations. `fsk_hz`: the other rate of FSK. PWM
      changes pulses alone, which are not played here.
    - `added`: to the waveform: "NOIS", of a peak-to-peak size (six deviations) of `noise_share` of
      the amplitude, "EXT", to which nothing is connected here, "BOTH", or nothing.
    - `burst`: whether `burst_cycles` are played at a time: every `burst_s` if `by_clock`, else
      `burst_delay_s` after the last trigger from outside, `fired_s` (s), as far as `burst_mode` is
      "TRIG". Before and after, such a burst rests at `burst_idle`: the waveform's "STAR", "END", or
      half-way between its levels, "DC".
    """

    frequency_hz: float = 1e6
    symmetry: float = 0.5
    duty: float = 0.5
    inverted: bool = False
    phase_rad: float = 0.0
    mode: str = "CW"
    modulation: set[str] = dataclasses.field(default_factory=set)
    modulation_hz: float = 10e3
    am_depth: float = 0.5
    fm_hz: float = 1e3
    pm_rad: float = math.pi / 2
    fsk_hz: float = 1e6
    sweep_from_hz: float = 100e3
    sweep_to_hz: float = 1e6
    sweep_s: float = 1.0
    added: str = ""
    noise_share: float = 0.1
    burst: bool = False
    by_clock: bool = True  # what begins a burst
    burst_cycles: float = 5.0
    burst_s: float = 1e-3
    burst_mode: str = "TRIG"
    burst_idle: str = "STAR"
    burst_delay_s: float = 0.0
    fired_s: float = -math.inf

    @property
    def burst_span_s(self) -> tuple[float, float]:
        """When the last burst begins and ends that was begun from outside, s; never, if gated."""
        if self.burst_mode == "GAT" or math.isinf(self.fired_s):  # no gate is connected
            return math.inf, math.inf
        begin = self.fired_s + self.burst_delay_s
        return begin, begin + self.burst_cycles / self.frequency_hz

    @property
    def _burst_by_clock(self) -> bool:
        """Whether bursts come one after the other; one without end is no burst."""
        return self.burst and self.by_clock and not math.isinf(self.burst_cycles)

    @property
    def sweep_hz(self) -> tuple[float, float]:
        """Centre and span of the sweep, Hz."""
        low, high = self.sweep_from_hz, self.sweep_to_hz
        return (low + high) / 2, abs(high - low)

    def rest(self, codes: np.ndarray) -> np.ndarray:
        """What it plays between two bursts."""
        code = {"STAR": codes[0], "END": codes[-1], "DC": FULL // 2}[self.burst_idle]
        return np.full(2, code, np.uint16)

    @property
    def fastest_hz(self) -> float:
        """The highest rate at which the waveform is repeated, Hz."""
        if self.mode == "SWE":
            return max(self.sweep_from_hz, self.sweep_to_hz)
        rates = [self.frequency_hz]
        if "FSK" in self.modulation:
            rates.append(self.fsk_hz)
        if "FM" in self.modulation:
            rates.append(self.frequency_hz + self.fm_hz)
        return max(rates)

    def play(self, codes: np.ndarray, low_v: float, high_v: float) -> AfgWaveform:
        """What comes out, as one period of whatever repeats: the waveform, or its modulation."""
        codes = FULL - codes if self.inverted else codes
        turn = round(self.phase_rad / (2 * math.pi) * codes.size)
        codes = np.roll(codes, -turn).astype(np.uint16)
        if not (self._burst_by_clock or self.mode == "SWE" or self.modulation - {"PWM"}):
            return AfgWaveform(self._with_noise(codes), low_v, high_v, self.frequency_hz)
        period_s = self._period_s()
        time = (np.arange(POINTS) + 0.5) * (period_s / POINTS)
        wave = np.sin(2 * np.pi * time / period_s)
        rate = np.full(POINTS, self.frequency_hz)
        if self.mode == "SWE":
            rate = np.linspace(self.sweep_from_hz, self.sweep_to_hz, POINTS)
        if "FM" in self.modulation:
            rate = rate + self.fm_hz * wave
        if "FSK" in self.modulation:
            rate = np.where(wave > 0, rate, self.fsk_hz)
        cycles = np.cumsum(rate) * (period_s / POINTS)
        if self._burst_by_clock:
            cycles = np.where(cycles < self.burst_cycles, cycles, 0.0)  # rests at its first code
        if "PM" in self.modulation:
            cycles = cycles + self.pm_rad / (2 * np.pi) * wave
        out = codes[((cycles % 1.0) * codes.size).astype(np.int64) % codes.size].astype(float)
        if "AM" in self.modulation:  # at its largest the amplitude is the one that is set
            scale = (1 + self.am_depth * wave) / (1 + self.am_depth)
            out = FULL / 2 + (out - FULL / 2) * scale
        return AfgWaveform(self._with_noise(out), low_v, high_v, 1 / period_s)

    def _with_noise(self, codes: np.ndarray) -> np.ndarray:
        """The same noise in each period of whatever repeats."""
        if self.added in ("NOIS", "BOTH"):
            noise = np.random.default_rng(0).standard_normal(codes.size)
            codes = np.clip(codes + noise * self.noise_share * FULL / 6, 0, FULL)
        return np.rint(codes).astype(np.uint16)

    def _period_s(self) -> float:
        if self.mode == "SWE":
            return self.sweep_s
        if self._burst_by_clock:
            return max(self.burst_s, 2 * self.burst_cycles / self.frequency_hz)
        return 1 / self.modulation_hz
