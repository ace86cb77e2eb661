"""Scans that could be taken next: shapes, rates, amplitudes and biases within the drive's limits.

Rates: from half the slowest rate seen to ten times the fastest, as far as slope, step and rate
limits allow; where the full swing would be too steep, a smaller one is taken. Voltages: those of
the limits that the recording has covered, and a little more (`Identified.limits`): a model says
nothing of others.
"""

import contextlib
import dataclasses
from collections.abc import Iterator
from typing import Any

import numpy as np

from rapi_jax import (
    Drive,
    DriveLimits,
    Identified,
    LimitError,
    Recording,
    multisine,
    sine,
    step_and_hold,
    triangle,
)
from rapi_jax.internal import Waveform, closing_step

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True, eq=False)
class Candidate:
    """One scan. `amplitude`: V peak to peak; `bias`: V, its centre.

    `smoothing`: half the width of a smoothed corner, in periods; 0 for sharp ones. `hold_s`: of
    each of the `levels` (V) of a step scan, which has no rate.
    """

    waveform: Waveform
    excitation_hz: float | None
    amplitude: float
    bias: float
    drive: Drive
    smoothing: float = 0.0
    hold_s: float | None = None
    levels: tuple[float, ...] = ()

    def to_dict(self) -> dict[str, Any]:
        """Plain numbers, without the drive."""
        out = {
            "waveform": self.waveform,
            "excitation_hz": self.excitation_hz,
            "amplitude": self.amplitude,
            "bias": self.bias,
            "smoothing": self.smoothing,
        }
        if self.hold_s is not None:
            out |= {"hold_s": self.hold_s, "levels": list(self.levels)}
        return out

    def describe(self, unit: str) -> str:
        """The scan in a sentence."""
        swing = f"{self.amplitude:.3g} {unit} peak to peak centred on {self.bias:.3g} {unit}"
        if self.excitation_hz is None:
            levels = ", ".join(f"{level:.3g}" for level in self.levels)
            return f"Steps to {levels} {unit} of {self.hold_s:.2g} s each"
        name = "smoothed triangle" if self.smoothing else self.waveform
        return f"A {name} at {self.excitation_hz:.3g} Hz, {swing}"


@dataclasses.dataclass(frozen=True, eq=False)
class _SearchSpace:
    """Limits, voltages and length of the candidates."""

    limits: DriveLimits
    low: float
    high: float
    widest: float
    samples: int  # a period
    periods: int
    start_s: float
    longest_hold_s: float

    @classmethod
    def of(
        cls, recording: Recording, limits: DriveLimits, samples: int, periods: int, start_s: float
    ) -> "_SearchSpace":
        """What the limits allow of what was recorded, and a little more."""
        seen = Identified.of(recording)
        near = seen.limits()
        low, high = max(limits.low_v, near.low_v), min(limits.high_v, near.high_v)
        if not low < high:
            low, high = limits.low_v, limits.high_v
        widest = min(max(max(seen.amplitudes), 1e-12), high - low)
        longest = max(float(np.ptp(drive.time)) for drive in recording.drives)
        hold = _round_down(THRESHOLDS.longest_hold * longest)
        return cls(limits, low, high, widest, samples, periods, start_s, hold)

    def fit_bias(self, amplitude: float, place: float) -> float:
        """A bias: `place` 0 as low as the swing fits, 1 as high, 1/2 in the middle."""
        room = max(self.high - self.low - amplitude, 0.0)
        bias = float(f"{self.low + amplitude / 2.0 + place * room:.4g}")
        return float(np.clip(bias, self.low + amplitude / 2.0, self.high - amplitude / 2.0))


def candidate_scans(
    recording: Recording, limits: DriveLimits, *, samples: int, periods: int, start_s: float
) -> list[Candidate]:
    """Scans of `periods` periods of `samples` samples, none beyond `limits`; steps are as long.

    None is one that was recorded: what it tells is in the data.
    """
    space = _SearchSpace.of(recording, limits, samples, periods, start_s)
    seen = Identified.of(recording)
    slow = min(seen.rates_hz, default=THRESHOLDS.default_rate)
    fast = max(seen.rates_hz, default=THRESHOLDS.default_rate)
    found: dict[tuple, Candidate] = {}
    for made in [*_periodic_scans(space, slow, fast), *_step_scans(space)]:
        try:
            limits.check(made.drive)
        except LimitError:
            continue
        if _is_recorded(made, recording):
            continue
        hz, hold = made.excitation_hz or 0.0, made.hold_s or 0.0
        numbers = (hz, made.amplitude, made.bias, made.smoothing, hold)
        levels = float(made.drive.value[0]) if hold else 0.0
        key = (made.waveform, *(float(f"{x:.3g}") for x in (*numbers, levels)))
        found.setdefault(key, made)
    return list(found.values())


def _is_recorded(scan: Candidate, recording: Recording) -> bool:
    """Whether a run has the waveform, rate, swing and centre of `scan`."""
    if scan.excitation_hz is None or scan.smoothing:
        return False
    near = THRESHOLDS.same_scan
    for drive in recording.drives:
        if not drive.repeats or drive.waveform != scan.waveform:
            continue
        bias = (float(drive.value.max()) + float(drive.value.min())) / 2.0
        off = (
            drive.rate / scan.excitation_hz - 1.0,
            drive.u_pp / scan.amplitude - 1.0,
            (bias - scan.bias) / scan.amplitude,
        )
        if max(map(abs, off)) < near:
            return True
    return False


def make_inner_sine(
    recording: Recording, limits: DriveLimits, *, samples: int, periods: int, start_s: float
) -> Candidate | None:
    """A sine of less swing than was recorded, at a rate between the slowest and the fastest.

    `None` where the limits do not allow it.
    """
    space = _SearchSpace.of(recording, limits, samples, periods, start_s)
    rates = Identified.of(recording).rates_hz or (THRESHOLDS.default_rate,)
    hz = float(f"{np.sqrt(min(rates) * max(rates)):.3g}")
    for made in _make_scan(space, "sine", hz, THRESHOLDS.inner_swing, 0.5):
        with contextlib.suppress(LimitError):
            limits.check(made.drive)
            return made
    return None


def _periodic_scans(space: _SearchSpace, slow: float, fast: float) -> Iterator[Candidate]:
    rates = sorted({slow / 2.0, slow, *(fast * times for times in THRESHOLDS.rate_multiples)})
    for hz in rates:
        if hz > space.limits.max_frequency_hz:
            continue
        for share, place in ((1.0, 0.5), (0.5, 0.0), (0.5, 1.0), (0.25, 0.5)):
            yield from _make_scan(space, "triangle", hz, share, place)
        for share, place in ((1.0, 0.5), (0.5, 1.0)):
            yield from _make_scan(space, "sine", hz, share, place)
        if hz >= fast:
            yield from _make_scan(space, "smooth", hz, 1.0, 0.5)
        yield from _make_scan(space, "multisine", hz, 1.0, 0.5)


def _make_scan(
    space: _SearchSpace, kind: str, hz: float, share: float, place: float
) -> Iterator[Candidate]:
    """The scan with `share` of the widest swing, or with as much as slope and step allow."""
    unit = _make_drive(space, kind, hz, 1.0, 0.0)
    steepest = max(float(np.abs(np.diff(unit.value)).max()), abs(closing_step(unit)))
    allowed = min(space.limits.slew_v_per_s * unit.step_s, space.limits.step_v) / steepest
    amplitude = _round_down(min(share * space.widest, allowed * THRESHOLDS.limit_margin))
    if amplitude < THRESHOLDS.least_swing * space.widest:
        return
    bias = space.fit_bias(amplitude, place)
    smoothing = THRESHOLDS.corner if kind == "smooth" else 0.0
    drive = _make_drive(space, kind, hz, amplitude, bias)
    yield Candidate(drive.waveform, hz, amplitude, bias, drive, smoothing)


def _make_drive(space: _SearchSpace, kind: str, hz: float, amplitude: float, bias: float) -> Drive:
    make = {"sine": sine, "multisine": multisine}.get(kind, triangle)
    total = space.samples * space.periods
    (made,) = make(hz, amplitude=amplitude, bias=bias, samples=total, periods=space.periods)
    value = made.value
    if kind == "smooth":
        cycles = np.arange(total) / space.samples
        value = bias + amplitude / 2.0 * _smoothed_triangle(cycles)
    return dataclasses.replace(made, value=value, start_s=space.start_s)


def _smoothed_triangle(cycles: np.ndarray) -> np.ndarray:
    """A triangle from -1 to 1 whose corners are parabolas, from its minimum."""
    away = np.abs(np.mod(cycles + 0.5, 1.0) - 0.5)  # from the minimum
    other = 0.5 - away
    value = np.where(
        away < THRESHOLDS.corner, (away**2 + THRESHOLDS.corner**2) / (2.0 * THRESHOLDS.corner), away
    )
    top = 0.5 - (other**2 + THRESHOLDS.corner**2) / (2.0 * THRESHOLDS.corner)
    value = np.where(other < THRESHOLDS.corner, top, value)
    return (4.0 * value - 1.0) / (1.0 - 2.0 * THRESHOLDS.corner)


def _step_scans(space: _SearchSpace) -> Iterator[Candidate]:
    total = space.samples * space.periods - 8  # so that corners between samples fit the row too
    amplitude = _round_down(space.widest)
    bias = space.fit_bias(amplitude, 0.5)
    low, high = bias - amplitude / 2.0, bias + amplitude / 2.0
    # What happens far beyond the longest run, nothing recorded tells.
    holds = sorted({min(hold, space.longest_hold_s) for hold in THRESHOLDS.hold_times})
    for hold in holds:
        for levels in ((low, high, low), (bias, high, low, bias)):
            count = len(levels)
            step_s = 2.0 * count * hold / total  # of the longest there can be
            slope = min(space.limits.slew_v_per_s, space.limits.step_v / step_s)
            rise = max(amplitude / slope / THRESHOLDS.limit_margin, 4.0 * step_s)
            if rise > hold:
                continue
            step_s = (count * hold + (count - 1) * rise) / total
            (made,) = step_and_hold(levels, hold_s=hold, rise_s=rise, step_s=step_s)
            drive = dataclasses.replace(made, start_s=space.start_s)
            yield Candidate("step", None, amplitude, bias, drive, hold_s=hold, levels=levels)


def _round_down(value: float) -> float:
    """To three digits, never up."""
    if value <= 0:
        return 0.0
    unit = 10.0 ** (np.floor(np.log10(value)) - 2)
    return float(f"{np.floor(value / unit * (1 + 1e-12)) * unit:.6g}")
