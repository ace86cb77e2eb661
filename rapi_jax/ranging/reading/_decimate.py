"""Fringe rates of a record, and its columns averaged down to what they need."""

import dataclasses

import numpy as np

from rapi_jax._errors import DataError

from ._thresholds import THRESHOLDS

_WINDOW, _WINDOWS = 1 << 14, 48  # samples, and how many of them over a record
_CHUNK = 1 << 20  # samples copied at once from an interleaved file


def fringe_rates(column: np.ndarray, sample_hz: float) -> tuple[float, float, float]:
    """Typical and highest fringe rate (Hz) of a column, and its signal-to-noise ratio in power.

    From the spectra of windows spread over the record, above the noise floor. All zero where there
    are no fringes.
    """
    length = min(_WINDOW, column.size)
    begins = np.unique(np.linspace(0, column.size - length, _WINDOWS).astype(int))
    window = np.hanning(length).astype(np.float32)
    power = np.zeros(length // 2 + 1)
    for begin in begins:
        part = column[begin : begin + length].astype(np.float32)
        power += np.abs(np.fft.rfft((part - part.mean()) * window)) ** 2
    power[:2] = 0.0
    floor = float(np.median(power[power.size // 2 :])) + 1e-30
    excess = np.where(power > 8.0 * floor, power, 0.0)
    total = np.cumsum(excess)
    if total[-1] <= 0:
        return 0.0, 0.0, 0.0
    hz = np.arange(power.size) * sample_hz / length
    low, high = np.searchsorted(total, [0.5 * total[-1], 0.995 * total[-1]])
    ratio = float(total[-1] / (floor * power.size))
    return float(hz[max(low, 1)]), float(hz[max(high, 1)]), ratio


def group_means(column: np.ndarray, factor: int) -> np.ndarray:
    """Means over consecutive groups of `factor` samples, float32; an incomplete one is dropped."""
    groups = column.size // factor
    if factor == 1:
        return column.astype(np.float32)
    out = np.empty(groups, dtype=np.float32)
    step = max(1, _CHUNK // factor)
    kind = np.int32 if column.dtype == np.int16 else np.float32
    for begin in range(0, groups, step):
        end = min(begin + step, groups)
        part = np.ascontiguousarray(column[begin * factor : end * factor])
        out[begin:end] = part.reshape(-1, factor).sum(axis=1, dtype=kind)
    out /= np.float32(factor)
    return out


@dataclasses.dataclass(frozen=True)
class Rates:
    """Fringe rates of a record, Hz, and the decimation that they allow.

    - `interferometer`, `measurement`: typical rates. `highest`: of either.
    - `factor`: samples a group.
    """

    interferometer: float
    measurement: float
    highest: float
    factor: int


def plan_decimation(
    interferometer: np.ndarray, measurement: np.ndarray, sample_hz: float, name: str
) -> tuple[Rates, list[str]]:
    """How far a record can be averaged down, and what is doubtful about its fringe rates.

    Raises `DataError` where the interferometer shows no fringes.
    """
    aux, aux_high, _ = fringe_rates(interferometer, sample_hz)
    if not aux:
        raise DataError(
            f"{name}: the auxiliary interferometer shows no fringes. Is the laser scanning, and is "
            "its channel the one that `channels` names?"
        )
    seen, seen_high, ratio = fringe_rates(measurement, sample_hz)
    faults = []
    if not seen:
        faults.append(
            f"{name}: no target: the measurement arm shows no fringes above its noise. Is the beam "
            "blocked, or the target out of reach?"
        )
    highest = max(aux_high, seen_high)
    limit = THRESHOLDS.nyquist * sample_hz
    if highest > limit:
        which = "measurement arm" if seen_high > limit else "auxiliary interferometer"
        faults.append(
            f"{name}: the {which} has fringes at {highest:.4g} Hz, more than "
            f"{THRESHOLDS.nyquist:g} of {sample_hz:.4g} samples a second: a target that moves half a fringe a sample or "
            "more is not seen as it is. Sample faster, or move it more slowly"
        )
    factor = max(1, int(sample_hz / (THRESHOLDS.samples_per_fringe * highest)))
    del ratio
    return Rates(aux, seen, highest, factor), faults
