"""Distance from the largest value of the spectrum over optical frequency."""

import functools

import numpy as np

from rapi_jax.ranging.reading._scans import Scans
from rapi_jax.ranging.reading._transforms import rfft

from ._estimates import AbstractEstimator, Estimates, motion_of_line
from ._resample import Resampled, find_beat, resample
from ._scale import CombReading, Scale
from ._thresholds import THRESHOLDS

_ORDERS = 12  # of the series about the largest bin; its rest is (pi/2)^12 / 12! = 5e-7


_SPREAD = "the beat is spread over many bins: a crooked scan of a moving target, or several targets"


class ResampleFFT(AbstractEstimator):
    """Resampled by the interferometer; the peak of the spectrum with a Hann window.

    The peak is found between bins, exactly: the windowed transform is continued from its largest
    bin by its moments.
    """

    @property
    def name(self) -> str:
        """As outputs call it."""
        return "resample-fft"

    @property
    def proportional(self) -> bool:
        """The interferometer is the clock."""
        return True

    def __call__(
        self, scans: Scans, combs: list[CombReading], scale: Scale, centre_hz: float
    ) -> Estimates:
        """Estimate every scan."""
        del combs
        resampled = resample(scans)
        return estimate_peaks(scans, resampled, scale, centre_hz)


def estimate_peaks(scans: Scans, resampled: Resampled, scale: Scale, centre_hz: float) -> Estimates:
    """The peak of samples that stand on an even grid already."""
    n = resampled.points
    window = np.hanning(n + 2)[1:-1]
    value = resampled.value[:, resampled.first : resampled.last + 1] * window.astype(np.float32)
    spectrum = rfft(value)
    beat = find_beat(spectrum)
    x = (np.arange(n) - (n - 1) / 2) * (2.0 / n)  # -1 to 1
    theta = np.pi * beat.peak  # rad over half the grid
    moments = np.empty((scans.count, _ORDERS), dtype=complex)
    basis = _powers(n)
    for k in range(scans.count):
        angle = np.remainder(theta[k] * x, 2 * np.pi).astype(np.float32)
        parts = np.stack([value[k] * np.cos(angle), -value[k] * np.sin(angle)])
        moments[k] = np.array([1.0, 1j]) @ (parts @ basis)
    offset = _largest(moments)
    # Of white noise: the variance of the peak's place for a window h is s^2 sum(h^2 x^2) / ...
    amplitude = 2 * np.abs(_series(moments, offset)) / window.sum()
    power = np.abs(spectrum) ** 2
    noise = np.median(power[:, power.shape[1] // 2 :], axis=1) / np.log(2.0)
    sigma = np.sqrt(noise / np.sum(window**2))  # of a sample
    spread = np.sqrt(np.sum((window * x) ** 2)) / np.sum(window * x**2)
    stderr = np.sqrt(2.0) * sigma / amplitude * spread  # rad over half the grid
    per_radian = 2.0 / (n * resampled.step)  # interferometer's delays
    motion, span, _ = motion_of_line(scans, scale, centre_hz, window)
    lost = beat.ratio < THRESHOLDS.detection
    # What is left of the power beside a tone of this amplitude: a beat that moved in the scan.
    beside = (window @ (value.astype(float) / window).T ** 2) / window.sum() - sigma**2
    tone = amplitude**2 / 2 / np.maximum(beside, 1e-30)
    problems = tuple(
        "no target: no beat stands out of the noise" if bad
        else _SPREAD if part < THRESHOLDS.one_tone
        else ""
        for bad, part in zip(lost, tone, strict=True)
    )  # fmt: skip
    delay = (theta + offset) * per_radian * scale.delay_s
    return Estimates(
        np.where(lost, np.nan, delay),
        stderr * per_radian * scale.delay_s,
        span,
        motion,
        problems=problems,
    )


@functools.lru_cache(maxsize=8)
def _powers(points: int) -> np.ndarray:
    x = (np.arange(points) - (points - 1) / 2) * (2.0 / points)
    return (x[:, None] ** np.arange(_ORDERS)[None, :]).astype(np.float32)


def _series(moments: np.ndarray, offset: np.ndarray, derivative: int = 0) -> np.ndarray:
    """The transform, or a derivative of it, at `offset` rad from where the moments are taken."""
    out = np.zeros(moments.shape[0], dtype=complex)
    factor = np.ones(moments.shape[0], dtype=complex)
    for k in range(moments.shape[1] - derivative):
        out += moments[:, k + derivative] * (-1j) ** derivative * factor
        factor = factor * (-1j * offset) / (k + 1)
    return out


def _largest(moments: np.ndarray) -> np.ndarray:
    """Where the transform's power is largest, by Newton's method; within a bin and a half."""
    offset = np.zeros(moments.shape[0])
    for _ in range(8):
        f, d, dd = (_series(moments, offset, k) for k in range(3))
        first = np.real(np.conj(f) * d)
        second = np.real(np.conj(f) * dd) + np.abs(d) ** 2
        step = np.where(second < 0, -first / np.where(second == 0, 1, second), 0.3 * np.sign(first))
        offset = np.clip(offset + np.clip(step, -0.5, 0.5), -2.0, 2.0)
    return offset
