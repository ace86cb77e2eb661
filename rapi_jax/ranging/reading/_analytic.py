"""Band-limited analytic signals of many scans at once."""

import numpy as np
from jaxtyping import Complex64, Float, Float64

from ._transforms import ifft, rfft


def taper(size: int, edge: int) -> np.ndarray:
    """A flat window with cosine edges of `edge` samples, float32."""
    out = np.ones(size, dtype=np.float32)
    if edge > 0:
        rise = (0.5 - 0.5 * np.cos(np.pi * (np.arange(edge) + 0.5) / edge)).astype(np.float32)
        out[:edge], out[size - edge :] = rise, rise[::-1]
    return out


def band_pass(size: int, low: float, high: float) -> np.ndarray:
    """Gains of positive frequencies 0 to 1/2 (cycles a sample), 2 in the band, with soft edges."""
    f = np.arange(size // 2 + 1) / size
    with np.errstate(divide="ignore"):
        octaves = np.log2(np.maximum(f, 1e-12))
    rise = np.clip((octaves - np.log2(low)) / 0.5 + 0.5, 0, 1)
    fall = np.clip((np.log2(high) - octaves) / 0.5 + 0.5, 0, 1)
    gain = np.sin(np.pi / 2 * rise) ** 2 * np.sin(np.pi / 2 * fall) ** 2
    return (2.0 * gain).astype(np.float32)


def analytic_signal(
    x: Float[np.ndarray, "scans samples"], gain: Float[np.ndarray, "*rows positive"]
) -> Complex64[np.ndarray, "scans samples"]:
    """The signal's positive frequencies, each with its gain: for all scans, or a row for each."""
    return band_limited(rfft(x), x.shape[-1], gain)


def band_limited(
    positive: np.ndarray, size: int, gain: Float[np.ndarray, "*rows positive"]
) -> Complex64[np.ndarray, "scans samples"]:
    """The same from the signal's positive frequencies; `size`: its samples."""
    spectrum = np.zeros((positive.shape[0], size), dtype=np.complex64)
    np.multiply(positive, gain, out=spectrum[:, : positive.shape[1]])
    return ifft(spectrum)


def unwrapped_phase(
    z: Complex64[np.ndarray, "scans samples"],
) -> Float64[np.ndarray, "scans samples"]:
    """Continuous phase, rad: neighbours differ by half a turn at most."""
    out = np.angle(z).astype(np.float64)
    turns = np.cumsum(np.rint(np.diff(out, axis=-1) / (2 * np.pi)), axis=-1)
    out[..., 1:] -= 2 * np.pi * turns
    return out
