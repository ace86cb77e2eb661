"""Amplitude and noise of fringes, from the spectrum of raw samples."""

import dataclasses

import numpy as np

_WINDOW, _WINDOWS = 1 << 12, 64


@dataclasses.dataclass(frozen=True)
class Light:
    """Fringes of one column: half their peak to peak, and rms of the white noise, in its unit."""

    amplitude: float
    noise: float


def measure_light(column: np.ndarray) -> Light:
    """From windows spread over the record; the noise is the floor in the upper half of the band."""
    length = min(_WINDOW, column.size // 2)
    begins = np.unique(np.linspace(0, column.size - length, _WINDOWS).astype(int))
    window = np.hanning(length)
    power = np.zeros(length // 2 + 1)
    for begin in begins:
        part = column[begin : begin + length].astype(float)
        power += np.abs(np.fft.rfft((part - part.mean()) * window)) ** 2
    power *= 2.0 / (begins.size * np.sum(window**2) * length)  # variance in each bin
    # A mean of `windows` exponential variables has its median below its mean.
    shape = begins.size
    floor = float(np.median(power[power.size // 2 :])) / (1.0 - 1.0 / (9.0 * shape)) ** 3
    signal = np.maximum(power - floor, 0.0)[3:]
    signal = float(signal[signal > 6.0 * floor / np.sqrt(shape)].sum())
    return Light(float(np.sqrt(2.0 * signal)), float(np.sqrt(floor * (power.size - 1))))
