"""Fourier transforms of many rows: SciPy's keep float32 and float64 apart; loaded when used."""

from typing import Any

import numpy as np


def rfft(x: np.ndarray) -> np.ndarray:
    """Positive frequencies of real rows."""
    from scipy import fft

    return np.asarray(fft.rfft(x, axis=-1))


def irfft(spectrum: np.ndarray, size: int) -> np.ndarray:
    """Real rows of `size` samples."""
    from scipy import fft

    return np.asarray(fft.irfft(spectrum, size, axis=-1))


def ifft(spectrum: np.ndarray) -> np.ndarray:
    """Complex rows; the spectrum may be overwritten."""
    from scipy import fft

    out: Any = fft.ifft(spectrum, axis=-1, overwrite_x=True)
    return out


def usable_size(samples: int) -> int:
    """The largest size up to `samples` whose transform is fast."""
    from scipy import fft

    for size in range(samples, max(samples // 2, 1), -1):
        if fft.next_fast_len(size, real=True) == size:
            return size
    return samples
