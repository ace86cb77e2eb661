"""Distance from counted fringes and counted cavity peaks: the paper's way (Eqs. 2 and 4)."""

import dataclasses
from typing import Literal

import numpy as np

from rapi_jax.ranging.reading._analytic import band_pass
from rapi_jax.ranging.reading._scans import Scans
from rapi_jax.ranging.reading._transforms import irfft, rfft

from ._estimates import AbstractEstimator, Estimates, Motion, centre_offset
from ._resample import find_beat
from ._scale import CombReading, Scale
from ._thresholds import THRESHOLDS

_TWO_PI = 2 * np.pi


@dataclasses.dataclass(frozen=True)
class Counting(AbstractEstimator):
    """Fringes over span (Eq. 2), both counted, with fractions interpolated in time (Eq. 4).

    - `ends`: `"peaks"` counts from the first cavity peak of the region of interest to the last, so
      that the span is a whole number of orders. `"region"` counts over the whole region, and
      interpolates orders between the cavity's peaks as fringes between their extrema: over 1.5 GHz
      a crooked scan then costs 30 times as much as over a fringe. The paper's spread without
      compensation (Table 2) is what this gives.
    """

    ends: Literal["peaks", "region"] = "peaks"

    @property
    def name(self) -> str:
        """As outputs call it."""
        return "counting" if self.ends == "peaks" else "counting-region"

    @property
    def proportional(self) -> bool:
        """Orders of the cavity are the scale."""
        return False

    def __call__(
        self, scans: Scans, combs: list[CombReading], scale: Scale, centre_hz: float
    ) -> Estimates:
        """Estimate every scan."""
        size = scans.signal.shape[1]
        spectrum = rfft(scans.signal * np.hanning(size).astype(np.float32))
        beat = find_beat(spectrum)
        raw = rfft(scans.signal)
        rows = [
            _scan(scans, k, combs[k], scale, raw[k], beat, centre_hz, self.ends)
            for k in range(scans.count)
        ]
        delay, stderr, span, velocity, acceleration, problems = zip(*rows, strict=True)
        return Estimates(
            np.array(delay),
            np.array(stderr),
            np.array(span),
            Motion(np.array(velocity), np.array(acceleration)),
            problems=tuple(problems),
        )


def extrema(spectrum: np.ndarray, size: int, low: float, high: float) -> np.ndarray:
    """Times of the extrema of a band-limited signal, in samples: zeros of its derivative."""
    gain = band_pass(size, max(low, 0.5) / size, min(high / size, 0.49)) / 2
    f = np.arange(size // 2 + 1) / size
    slope = irfft(spectrum * gain * (1j * _TWO_PI * f), size)
    at = np.flatnonzero(np.signbit(slope[1:]) != np.signbit(slope[:-1]))
    return at + slope[at] / (slope[at] - slope[at + 1])


def _scan(scans: Scans, k: int, comb: CombReading, scale: Scale, spectrum, beat, centre_hz, kind):
    nothing = (np.nan, np.nan, np.nan, np.nan, np.nan)
    if beat.ratio[k] < THRESHOLDS.detection:
        return (*nothing, "no target: no beat stands out of the noise")
    if comb.order.size < 3 or scale.spacing_hz is None:
        return (*nothing, "fewer than three peaks of the cavity: counting has no span")
    size = scans.signal.shape[1]
    at = extrema(spectrum, size, beat.low[k], beat.high[k])
    peaks = (comb.time_s - scans.begin_s[k]) * scans.hz
    inside = (peaks >= scans.first) & (peaks <= scans.last)
    if inside.sum() < 2:
        return (*nothing, "fewer than two peaks of the cavity in the region of interest")
    if kind == "peaks":
        ends, order = peaks[inside][[0, -1]], comb.order[inside][[0, -1]]
    else:
        ends = np.array([scans.first, scans.last], dtype=float)
        if peaks[0] > ends[0] or peaks[-1] < ends[1]:
            return (*nothing, "no cavity peaks beside the region of interest")
        order = np.interp(ends, peaks, comb.order)  # Eq. (4), of the cavity
    if at.size < 4 or at[0] > ends[0] or at[-1] < ends[1]:
        return (*nothing, "too few fringes at the ends of the span")
    half = np.arange(at.size)
    cycles = np.interp(ends, at, half) / 2  # Eq. (4), whole fringes and both fractions
    span = float(order[1] - order[0]) * scale.spacing_hz
    delay = (cycles[1] - cycles[0]) / span  # Eq. (2)
    # The same interpolation on the interferometer's phase shows what a crooked scan makes of it.
    bent = _interpolation_error(scans, k, at, ends)
    # What is left of a line through the extrema over optical frequency is the noise of each.
    inside = (at >= ends[0]) & (at <= ends[1])
    phase = np.interp(at[inside], np.arange(size), scans.phase[k])
    rest = half[inside] / 2
    scaled = (phase - phase[0]) / (phase[-1] - phase[0]) * 2 - 1
    along = 2 * (at[inside] - ends[0]) / (ends[1] - ends[0]) - 1
    degree = min(THRESHOLDS.smooth, rest.size // 4)
    # Smooth in optical frequency, or in time: the target's motion, not noise.
    smooth = np.hstack(
        [
            np.polynomial.legendre.legvander(scaled, degree),
            np.polynomial.legendre.legvander(along, min(3, degree))[:, 1:],
        ]
    )
    rest = rest - smooth @ np.linalg.lstsq(smooth, rest, rcond=None)[0]
    noise = float(np.std(rest))
    slope_hz_s = abs(span / (ends[1] - ends[0]) * scans.hz)
    end_hz = float(np.hypot(np.median(comb.stderr_s) * slope_hz_s, scale.comb_hz))
    stderr = np.hypot(np.sqrt(2.0) * np.hypot(noise, delay * end_hz), bent) / span
    sign = 1.0 if scans.rising else -1.0
    time = (ends - (scans.first + scans.last) / 2) / scans.hz
    place = np.arange(size)
    near = np.array([np.interp(end, place, scans.phase[k]) for end in ends])
    low, high = (np.full(scans.count, end) for end in near)
    centre = centre_hz + centre_offset(scans, low, high, scale)[k]
    g = sign * np.array([-1.0, 1.0]) * centre / span
    mean = time.mean()
    velocity = float(g @ time) + mean
    acceleration = float(g @ time**2) / 2
    problem = ""
    if noise > THRESHOLDS.jitter:
        problem = "fringes lost, or a beat that is not of one target at one speed"
    return float(delay), float(stderr), span, velocity, acceleration, problem


def _interpolation_error(scans: Scans, k: int, at: np.ndarray, ends: np.ndarray) -> float:
    """Error of the two fractions together, in cycles, if the phase is one of optical frequency."""
    place = np.arange(scans.phase.shape[1])
    j = np.clip(np.searchsorted(at, ends) - 1, 0, at.size - 2)
    here, there = at[j], at[j + 1]
    low, high, end = (np.interp(x, place, scans.phase[k]) for x in (here, there, ends))
    by_time, by_phase = (ends - here) / (there - here), (end - low) / (high - low)
    return float(np.diff(by_time - by_phase)[0] / 2)
