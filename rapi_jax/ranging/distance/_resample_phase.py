"""Distance from the slope of the measurement arm's phase over optical frequency."""

import functools

import numpy as np

from rapi_jax.ranging.reading._analytic import band_limited, band_pass, unwrapped_phase
from rapi_jax.ranging.reading._scans import Scans
from rapi_jax.ranging.reading._transforms import rfft

from ._estimates import AbstractEstimator, Estimates, motion_of_line
from ._resample import Resampled, find_beat, resample
from ._scale import CombReading, Scale
from ._thresholds import THRESHOLDS


class ResamplePhase(AbstractEstimator):
    """Resampled by the interferometer; a straight line through the phase by least squares.

    Of one reflector in white noise this is the estimate of least variance, and it uses the whole
    region of interest evenly.
    """

    @property
    def name(self) -> str:
        """As outputs call it."""
        return "resample-phase"

    @property
    def proportional(self) -> bool:
        """The interferometer is the clock."""
        return True

    def __call__(
        self, scans: Scans, combs: list[CombReading], scale: Scale, centre_hz: float
    ) -> Estimates:
        """Estimate every scan."""
        del combs
        return estimate_resampled(scans, resample(scans), scale, centre_hz)


def estimate_resampled(
    scans: Scans, resampled: Resampled, scale: Scale, centre_hz: float
) -> Estimates:
    """The slope of the phase of samples that stand on an even grid already."""
    spectrum = rfft(resampled.value)
    beat = find_beat(spectrum)
    size = resampled.value.shape[1]
    gain = np.stack(
        [
            band_pass(size, max(low, 0.5) / size, min(high / size, 0.49))
            for low, high in zip(beat.low, beat.high, strict=True)
        ]
    )
    z = band_limited(spectrum, size, gain)[:, resampled.first : resampled.last + 1]
    phase = unwrapped_phase(z)
    n = resampled.points
    x = np.arange(n) - (n - 1) / 2
    xx = float(x @ x)
    slope = (phase @ x) / xx
    phase -= phase.mean(axis=1, keepdims=True)
    phase -= slope[:, None] * x[None, :]
    # The filter lets a part of white noise pass, which stands on both sides of the phase's zero
    # frequency; the line sees it as if it were as dense up to the rate of the samples.
    passed = np.sum((gain / 2) ** 2, axis=1) / size
    motion, span, time = motion_of_line(scans, scale, centre_hz, None)
    left = _less_smooth(phase, time)
    stderr = np.sqrt(np.mean(left**2, axis=1) / np.minimum(passed, 1.0) / xx)
    ratio = np.abs(slope) / resampled.step
    problems = []
    light = _blurred(np.abs(z))
    for k in range(scans.count):
        problem = ""
        if beat.ratio[k] < THRESHOLDS.detection:
            problem = "no target: no beat stands out of the noise"
        elif light[k].min() < THRESHOLDS.lost_light * np.median(light[k]):
            problem = "fringes lost, or a beat that is not of one target at one speed"
        problems.append(problem)
    lost = np.array([p.startswith("no target") for p in problems])
    delay = np.where(lost, np.nan, ratio * scale.delay_s)
    return Estimates(
        delay,
        stderr / resampled.step * scale.delay_s,
        span,
        motion,
        problems=tuple(problems),
    )


_STRIDE = 4  # samples between those that tell the noise: fewer than the filter lets through


def _less_smooth(phase: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Residual phase less its smooth part, which is the target's motion, not noise.

    Smooth in optical frequency, or in time: a crooked scan bends what is even in time. `time`: of
    each scan on an even grid of optical frequency, s.
    """
    some = phase[:, ::_STRIDE]
    basis = _smooth_basis(some.shape[1])
    left = some - (some @ basis) @ basis.T
    place = np.linspace(0.0, time.shape[1] - 1.0, some.shape[1])
    for k in range(some.shape[0]):
        along = np.interp(place, np.arange(time.shape[1]), time[k] / np.ptp(time[k]))
        powers = np.stack([along, along**2, along**3], axis=1)
        powers -= basis @ (basis.T @ powers)
        coefficients = np.linalg.lstsq(powers, left[k], rcond=1e-9)[0]
        left[k] -= powers @ coefficients
    return left


@functools.lru_cache(maxsize=8)
def _smooth_basis(points: int) -> np.ndarray:
    legendre = np.polynomial.legendre.legvander(np.linspace(-1, 1, points), THRESHOLDS.smooth)
    return np.linalg.qr(legendre)[0]


def _blurred(light: np.ndarray) -> np.ndarray:
    """Visibility in 64 stretches of each scan."""
    stretch = max(1, light.shape[1] // 64)
    whole = light.shape[1] // stretch * stretch
    return light[:, :whole].reshape(light.shape[0], -1, stretch).mean(axis=2)
