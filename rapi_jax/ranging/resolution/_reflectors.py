"""Reflectors in evenly sampled fringes, one after the other, by nonlinear least squares."""

import dataclasses

import numpy as np
from jaxtyping import Float

from rapi_jax._errors import DataError
from rapi_jax.readout._levenberg_marquardt import Fit, levenberg_marquardt

from ._thresholds import THRESHOLDS

Column = Float[np.ndarray, " reflectors"]


@dataclasses.dataclass(frozen=True, eq=False)
class Reflectors:
    """Reflectors that were found, by delay.

    - `delay_s`, `delay_stderr_s`: delays and standard errors, s; half of c times it is a distance.
    - `amplitude`, `amplitude_stderr`: of the fringes, in the samples' unit.
    - `noise_rms`: of what is left, in the samples' unit.
    - `p_values`: of each reflector tried: the probability that noise alone gains as much at any
      delay; the last is above the false-alarm probability unless all that were allowed are found.
    """

    delay_s: Column
    amplitude: Column
    delay_stderr_s: Column
    amplitude_stderr: Column
    noise_rms: float
    p_values: tuple[float, ...]

    @property
    def count(self) -> int:
        """Number of reflectors."""
        return self.delay_s.size


def find_reflectors(
    samples: Float[np.ndarray, " samples"],
    step_hz: float,
    *,
    most: int = 3,
    false_alarm: float = 0.01,
) -> Reflectors:
    """Reflectors in fringes sampled evenly in optical frequency.

    Background and up to `most` sines are fitted together; another one is taken where noise alone
    would reduce the sum of squares as much, at any delay, with at most probability `false_alarm`.
    Noise is taken for white and normal. Samples even in time may be given too, with their step in
    s: delays are then beat frequencies in Hz, and a crooked scan shows reflectors that are none.

    **Arguments:**

    - `samples`: fringes, in any unit. `step_hz`: optical frequency from one to the next, Hz.
    - `most`: reflectors to look for. `false_alarm`: probability of one too many, 0 to 1.

    Raises `DataError` for fewer than 16 samples a reflector, values that are no number, or options
    that cannot be.
    """
    x = np.asarray(samples, dtype=float)
    if x.ndim != 1 or x.size < 16 * (most + 1) or not np.isfinite(x).all():
        raise DataError(
            f"`samples` must be at least {16 * (most + 1)} finite numbers in one column for "
            f"{most} reflector(s), but has shape {x.shape}."
        )
    if not (step_hz > 0 and 0 < false_alarm < 1 and most >= 1):
        raise DataError(
            "`step_hz` and `most` must be positive and `false_alarm` between 0 and 1, but they are "
            f"{step_hz}, {most} and {false_alarm}."
        )
    level = float(x.std()) or 1.0
    found, p_values = _fit(x / level, np.empty(0)), []
    while found.parameters.size // 3 < most:
        tried = min((_fit(x / level, start) for start in _starts(found)), key=lambda fit: fit.cost)
        p_values.append(_p_value(found, tried))
        if p_values[-1] > false_alarm:
            break
        found = tried
    return _described(found, step_hz, level, tuple(p_values))


def _place(size: int) -> np.ndarray:
    """Samples' places in the span, -1/2 to 1/2: a delay in bins turns the phase once over 1."""
    return (np.arange(size) - (size - 1) / 2.0) / size


def _fit(x: np.ndarray, bins: np.ndarray) -> Fit:
    """Background and sines near these delays (in bins, 1/span); parameters (bins, a, b, c)."""
    place, count = _place(x.size), bins.size

    def model(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        angle = 2.0 * np.pi * place[:, None] * p[:count]
        cosine, sine = np.cos(angle), np.sin(angle)
        a, b = p[count : 2 * count], p[2 * count : 3 * count]
        slope = 2.0 * np.pi * place[:, None] * (b * cosine - a * sine)
        jacobian = np.concatenate([slope, cosine, sine, np.ones((x.size, 1))], axis=1)
        return jacobian[:, count:] @ p[count:], jacobian

    start = np.concatenate([bins, np.zeros(2 * count + 1)])
    linear = model(start)[1][:, count:]
    start[count:] = np.linalg.lstsq(linear, x, rcond=None)[0]
    low, high = THRESHOLDS.nearest, x.size / 2.0 - THRESHOLDS.nearest

    def project(trial: np.ndarray, before: np.ndarray) -> np.ndarray:
        moved = trial.copy()
        moved[:count] = np.clip(trial[:count], before[:count] - 0.5, before[:count] + 0.5)
        moved[:count] = np.clip(moved[:count], low, high)
        return moved

    return levenberg_marquardt(
        model,
        x,
        start,
        steps=THRESHOLDS.steps,
        tolerance=THRESHOLDS.tolerance,
        project=project,
    )


def _starts(found: Fit) -> list[np.ndarray]:
    """Delays to start one more reflector from: the residual's peak, or one of those, split."""
    size, padding = found.residual.size, THRESHOLDS.padding
    bins = found.parameters[: found.parameters.size // 3]
    spectrum = np.abs(np.fft.rfft(found.residual, padding * size))
    low = int(np.ceil(THRESHOLDS.nearest * padding))
    peak = (low + int(np.argmax(spectrum[low : -low or None]))) / padding
    starts = [np.append(bins, peak)]
    for number in range(bins.size):
        for split in THRESHOLDS.split:
            pair = bins[number] + split * np.array([-0.5, 0.5])
            starts.append(np.append(np.delete(bins, number), np.maximum(pair, THRESHOLDS.nearest)))
    return starts


def _p_value(found: Fit, tried: Fit) -> float:
    """Probability that white noise gains as much by one more sine at any delay.

    The gain in variances is chi-square of two degrees of freedom at each delay, and a process along
    it: its maximum exceeds z with the probability at one delay, and with the mean number of
    crossings of z upwards, sqrt(pi z / 6) exp(-z / 2) a bin (Davies, Biometrika 74, 33 (1987)).
    The exponential is that of Student's law for a variance that is estimated.
    """
    size = found.residual.size
    free = size - tried.parameters.size
    gain = max(found.cost - tried.cost, 0.0) / max(tried.cost / free, np.finfo(float).tiny)
    tail = np.exp(-0.5 * free * np.log1p(gain / free))
    crossings = size / 2.0 * np.sqrt(np.pi * gain / 6.0)
    return float(-np.expm1(-tail * (1.0 + crossings)))


def _described(fit: Fit, step: float, level: float, p_values: tuple[float, ...]) -> Reflectors:
    """Physical units, errors from the Jacobian, in the order of delays."""
    size, count = fit.residual.size, fit.parameters.size // 3
    free = size - fit.parameters.size
    variance = fit.cost / free
    cov = variance * np.linalg.pinv(fit.jacobian.T @ fit.jacobian)
    bins, a, b = (fit.parameters[k * count : (k + 1) * count] for k in range(3))
    order = np.argsort(bins)
    amplitude = np.hypot(a, b)
    along = np.zeros((count, fit.parameters.size))  # derivative of the amplitude
    number = np.arange(count)
    along[number, count + number] = a / amplitude
    along[number, 2 * count + number] = b / amplitude
    amplitude_var = np.einsum("ki,ij,kj->k", along, cov, along)
    span = step * size
    return Reflectors(
        delay_s=bins[order] / span,
        amplitude=level * amplitude[order],
        delay_stderr_s=np.sqrt(np.diag(cov)[:count])[order] / span,
        amplitude_stderr=level * np.sqrt(amplitude_var)[order],
        noise_rms=float(level * np.sqrt(variance)),
        p_values=p_values,
    )
