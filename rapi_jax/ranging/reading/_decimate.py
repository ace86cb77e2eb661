"""Fringe rates of a record, and its columns averaged down to what they need."""

import dataclasses

import numpy as np

from rapi_jax._errors import DataError

from ._threads import side_by_side
from ._thresholds import THRESHOLDS

_WINDOW, _WINDOWS = 1 << 14, 48  # samples, and how many of them over a record
_CHUNK = 1 << 16  # samples of each column at once: they stay in a processor's cache


def fringe_rates(column: np.ndarray, sample_hz: float) -> tuple[float, float]:
    """Typical and highest fringe rate of a column, Hz.

    From the spectra of windows spread over the record, above the noise floor. Both zero where there
    are no fringes.
    """
    length = min(_WINDOW, column.size)
    begins = np.unique(np.linspace(0, column.size - length, _WINDOWS).astype(int))
    window = np.hanning(length).astype(np.float32)
    power = np.zeros(length // 2 + 1)
    for begin in begins:
        part = column[begin : begin + length].astype(np.float32)
        if np.ptp(part) <= 1e-5 * np.abs(part).max():  # constant, but for rounding
            continue
        power += np.abs(np.fft.rfft((part - part.mean()) * window)) ** 2
    power[:2] = 0.0
    floor = float(np.median(power[power.size // 2 :])) + 1e-30
    excess = np.where(power > 8.0 * floor, power, 0.0)
    total = np.cumsum(excess)
    if total[-1] <= 0:
        return 0.0, 0.0
    hz = np.arange(power.size) * sample_hz / length
    low, high = np.searchsorted(total, [0.5 * total[-1], 0.995 * total[-1]])
    return float(hz[max(low, 1)]), float(hz[max(high, 1)])


def check_finite(column: np.ndarray, what: str, name: str) -> None:
    """Raise `DataError` where a column of floating-point numbers holds one that is not finite."""
    if column.dtype.kind != "f":
        return
    for begin in range(0, column.size, _CHUNK):
        good = np.isfinite(column[begin : begin + _CHUNK])
        if not good.all():
            raise DataError(
                f"{name}: `{what}` is not finite at sample {begin + int(np.argmin(good))}. Fringes "
                "are not guessed: export the record again."
            )


def group_means(column: np.ndarray, factor: int) -> np.ndarray:
    """Means over consecutive groups of `factor` samples, float32; an incomplete one is dropped."""
    return decimate((column,), factor)[0]


def decimate(columns: tuple[np.ndarray, ...], factor: int) -> list[np.ndarray]:
    """`group_means` of several columns, which may be interleaved in one file, in one pass."""
    groups = columns[0].size // factor
    out = [np.empty(groups, dtype=np.float32) for _ in columns]
    step = max(1, _CHUNK // factor)

    def work(begin: int) -> None:
        end = min(begin + step, groups)
        for column, mean in zip(columns, out, strict=True):
            part = np.ascontiguousarray(column[begin * factor : end * factor])
            if factor == 1:
                mean[begin:end] = part
                continue
            kind = np.int32 if part.dtype == np.int16 else np.float32
            sums = part.reshape(-1, factor).sum(axis=1, dtype=kind)
            np.multiply(sums, np.float32(1.0 / factor), out=mean[begin:end], casting="same_kind")

    side_by_side(work, range(0, groups, step))
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
    for column, what in ((interferometer, "interferometer"), (measurement, "measurement")):
        check_finite(column, what, name)
    aux, aux_high = fringe_rates(interferometer, sample_hz)
    if not aux:
        raise DataError(
            f"{name}: the auxiliary interferometer shows no fringes. Is the laser scanning, and is "
            "its channel the one that `channels` names?"
        )
    seen, seen_high = fringe_rates(measurement, sample_hz)
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
        shown = seen_high if seen_high > limit else aux_high
        faults.append(
            f"{name}: the {which} has fringes at {shown:.4g} Hz, more than "
            f"{THRESHOLDS.nyquist:g} of {sample_hz:.4g} samples a second: beyond half of it "
            "fringes are aliased. Sample faster, scan more slowly, or move the target more slowly"
        )
    of_aux, of_seen = THRESHOLDS.samples_per_fringe
    factor = max(1, int(sample_hz / max(of_aux * aux_high, of_seen * seen_high)))
    return Rates(aux, seen, highest, factor), faults
