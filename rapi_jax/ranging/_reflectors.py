"""Whether a target at rest is the only one: lines beside the strongest in averaged spectra."""

import dataclasses

import numpy as np

from rapi_jax._metrics import SPEED_OF_LIGHT as C

from ._thresholds import THRESHOLDS
from .distance._resample import resample
from .reading._scans import Scans
from .reading._thresholds import THRESHOLDS as READING
from .reading._transforms import rfft

_PADDING = 4  # spectral values a bin
_LOWEST = 4  # bins; below it are the signal's slow changes
_SAME = 2  # bins, within which peaks of scans are of one reflector
_NEAR_HARMONIC = 3  # bins; a bent fringe has lines at two and three times its frequency


@dataclasses.dataclass(frozen=True)
class OtherReflector:
    """A reflector beside the strongest one.

    - `offset_m`: its apparent distance less that of the strongest, m. `amplitude`: of its fringes,
      relative to those. `cells`: the offset in resolution cells c/2dnu.
    """

    offset_m: float
    amplitude: float
    cells: float

    def __str__(self) -> str:
        where = "beyond" if self.offset_m > 0 else "before"
        return (
            f"a second reflector about {1e3 * abs(self.offset_m):.3g} mm {where} the strongest, "
            f"with {100 * self.amplitude:.0f} % of its fringes' amplitude: distances are those of "
            "the strongest, and pulled by the other. Block or tilt what reflects"
        )


def find_other(groups: tuple[Scans, ...], delay_s: float) -> OtherReflector | None | bool:
    """The strongest reflector beside the first in some scans; `None` where there is none.

    Power spectra over optical frequency (Hann window) are aligned at their peak and averaged; of
    reflectors that are as strong, at that of the first scan.
    A reflector stands on one side alone: vibration puts lines on both sides alike, and
    a moving target widens the peak.

    **Returns:** `False` where the scans do not tell: no fringes, or a peak wider than its window.
    """
    spectra, cells = [], []
    first = None
    for scans in groups:
        usable = (scans.reference > READING.low_light) & (scans.measurement_hz > 0)
        if usable.any() and len(spectra) < THRESHOLDS.scans_for_reflectors:
            found, where = _peak_power(scans, usable, first)
            first = where[0][0] * where[0][1] if first is None else first
            spectra += [_around_peak(*one, _reach(found)) for one in found]
            cells += where
    if not spectra:
        return False
    reach = min(power.size for power in spectra) // 2
    power = np.mean([one[one.size // 2 - reach : one.size // 2 + reach + 1] for one in spectra], 0)
    middle = reach
    # A moving target widens both flanks; a reflector nearby one of them.
    wide = power[[middle - 3 * _PADDING // 2, middle + 3 * _PADDING // 2]].min()
    if wide > THRESHOLDS.wide_peak:
        return False
    offset = np.arange(power.size) - middle
    peak_bin = float(np.median([cell[0] for cell in cells]))
    allowed = (np.abs(offset) >= 2 * _PADDING) & (np.abs(offset) < middle)
    for factor in (2, 3):
        place = np.abs(offset / _PADDING - (factor - 1) * peak_bin)
        allowed &= place > _NEAR_HARMONIC
    allowed &= power > THRESHOLDS.one_sided * power[::-1]
    if not allowed.any():
        return None
    best = int(np.argmax(np.where(allowed, power, 0.0)))
    noise = float(np.median(power))
    if np.sqrt(power[best]) < THRESHOLDS.other_reflector or power[best] < 12 * noise:
        return None
    left, top, right = np.sqrt(power[best - 1 : best + 2])
    bend = left - 2 * top + right
    bins = (offset[best] + (0.5 * (left - right) / bend if bend < 0 else 0.0)) / _PADDING
    a_bin = float(np.median([cell[1] for cell in cells]))  # interferometer's delays
    return OtherReflector(
        float(bins * a_bin * delay_s * C / 2), float(np.sqrt(power[best])), float(abs(bins))
    )


def _peak_power(scans: Scans, usable: np.ndarray, first: float | None):
    """Power of each usable scan, 1 at its peak, with its place; peaks (bins) and a bin's delay.

    `first`: delay near which the peak is to be, in the interferometer's; the largest where `None`.
    """
    resampled = resample(scans)
    n = resampled.points
    window = np.hanning(n + 2)[1:-1].astype(np.float32)
    value = resampled.value[usable, resampled.first : resampled.last + 1] * window
    padded = np.zeros((value.shape[0], _PADDING * n), dtype=np.float32)
    padded[:, :n] = value
    power = np.abs(rfft(padded)).astype(float) ** 2
    power[:, : _LOWEST * _PADDING] = 0.0
    found, where = [], []
    for one, step in zip(power, resampled.step[usable], strict=True):
        cell = float(2 * np.pi / (n * step))
        first = np.argmax(one) / _PADDING * cell if first is None else first
        near = int(round(first / cell * _PADDING))
        low = max(near - _SAME * _PADDING, 0)
        peak = low + int(np.argmax(one[low : near + _SAME * _PADDING + 1]))
        found.append((one / (one[peak] + 1e-300), peak))
        where.append((peak / _PADDING, cell))
    return found, where


def _reach(found) -> int:
    return min(power.size for power, _ in found)


def _around_peak(power: np.ndarray, peak: int, size: int) -> np.ndarray:
    """The spectrum with its peak in the middle; zero beyond its ends."""
    out = np.zeros(2 * size + 1)
    begin = size - peak
    part = power[: out.size - begin]
    out[begin : begin + part.size] = part
    return out
