"""The part of a signal that repeats with a drive's period, without the noise of its samples."""

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive

Samples = Float[np.ndarray, " samples"]


def average_periods(
    drive: Drive, value: Samples, rate: float, *, constant: bool
) -> tuple[Samples, int | None]:
    """The mean of `value` at equal phases of the drive, and the highest harmonic kept in it.

    Harmonics from the one on that noise exceeds are left out; of steps, which have edges, all stay,
    and `None` comes back. The mean over one period is left out unless `constant`. `rate` (Hz) is
    that of the period. The drive has a whole one.
    """
    cycles = rate * drive.time
    phases = max(round(1.0 / (rate * drive.step_s)), 8)
    grid = np.arange(phases) / phases
    begin = cycles[np.flatnonzero(drive.period == 0)[0]]  # a broken end may be that of another run
    table = np.stack([np.interp(begin + grid + k, cycles, value) for k in range(drive.periods)])
    mean = table.mean(axis=0)
    series = np.fft.rfft(mean) / phases
    power = np.abs(series[1:]) ** 2
    noise = _noise_power(table, power)
    # By what keeping harmonics 1 to k lowers the error, with a price for each that is kept.
    gains = np.concatenate([[0.0], np.cumsum(power - THRESHOLDS.harmonic_price * noise)])
    kept = int(np.argmax(gains))
    edges = drive.waveform == "step"
    if not edges:
        series[kept + 1 :] = 0.0
    if not constant:
        series[0] = 0.0
    fine = np.fft.irfft(series * phases, phases)
    if edges:
        return np.interp(np.mod(cycles - begin, 1.0) * phases, np.arange(phases + 1.0),
                         np.append(fine, fine[0])), None  # fmt: skip
    return _evaluate(series[: kept + 1], cycles - begin), kept


def _noise_power(table: Float[np.ndarray, "periods phases"], power: np.ndarray) -> float:
    """Of white noise in one harmonic of the mean period.

    From what differs between periods and, since a converter's steps may be the same in each, from
    the upper half of the harmonics; the larger of them.
    """
    upper = float(np.median(power[power.size // 2 :])) / np.log(2.0)
    if len(table) < 2:
        return upper
    between = float(np.mean(np.var(table, axis=0, ddof=1))) / len(table)
    return max(between / table.shape[1], upper)


def _evaluate(series: np.ndarray, cycles: Samples) -> Samples:
    total = np.full(cycles.size, series[0].real)
    for number, one in enumerate(series[1:], 1):
        total += 2.0 * (one * np.exp(2j * np.pi * number * cycles)).real
    return total
