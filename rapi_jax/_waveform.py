"""Standard drives: triangle, sine, multisine, step and hold. Each starts at its minimum."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np

from ._arguments import takes
from ._errors import DataError
from .recording._drive import Drive, Waveform

Shape = Callable[[np.ndarray], np.ndarray]  # cycles since the minimum -> -1 to 1


def _periodic(
    frequencies: float | Sequence[float],
    shape: Shape,
    name: Waveform,
    amplitude: float,
    bias: float,
    samples: int,
    periods: int,
) -> tuple[Drive, ...]:
    if samples < 8 * periods or periods < 1:
        raise ValueError(
            "Arguments `samples` and `periods` must give at least 8 samples a period, but give "
            f"{samples} over {periods}."
        )
    drives = []
    start = 0.0
    for frequency in np.atleast_1d(np.asarray(frequencies, dtype=float)):
        if not frequency > 0:
            raise ValueError(f"Argument `frequencies` must be positive, but holds {frequency}.")
        cycles = np.arange(samples) * (periods / samples)
        value = bias + amplitude / 2.0 * shape(cycles)
        drives.append(Drive(cycles / frequency, value, float(frequency), name, start))
        start += periods / float(frequency)
    return tuple(drives)


def triangle(
    frequencies: float | Sequence[float],
    *,
    amplitude: float,
    bias: float,
    samples: int = 4000,
    periods: int = 1,
) -> tuple[Drive, ...]:
    """A triangle at each of `frequencies` (Hz); `amplitude` is peak to peak, `bias` the centre (V).

    `samples` is the number in a run of `periods` periods. Runs follow each other in session time.

    >>> from rapi_jax import triangle
    >>> slow, fast = triangle([10.0, 40.0], amplitude=4.5, bias=3.0, samples=200, periods=2)
    >>> float(slow.value.min()), float(slow.value.max()), fast.periods
    (0.75, 5.25, 2)
    """

    def shape(cycles: np.ndarray) -> np.ndarray:
        return 1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles, 1.0))

    return _periodic(frequencies, shape, "triangle", amplitude, bias, samples, periods)


def sine(
    frequencies: float | Sequence[float],
    *,
    amplitude: float,
    bias: float,
    samples: int = 4000,
    periods: int = 1,
) -> tuple[Drive, ...]:
    """A sine at each of `frequencies`, from its minimum; arguments as for `triangle`.

    >>> from rapi_jax import sine
    >>> (drive,) = sine(20.0, amplitude=4.0, bias=3.0, samples=200)
    >>> [round(float(volt), 6) for volt in (drive.value.min(), drive.value.max())]
    [1.0, 5.0]
    """

    def shape(cycles: np.ndarray) -> np.ndarray:
        return -np.cos(2.0 * np.pi * cycles)

    return _periodic(frequencies, shape, "sine", amplitude, bias, samples, periods)


def multisine(
    frequencies: float | Sequence[float],
    *,
    amplitude: float,
    bias: float,
    harmonics: Sequence[int] = (1, 2, 3, 5),
    samples: int = 4000,
    periods: int = 1,
) -> tuple[Drive, ...]:
    """Equal harmonics, Schroeder phases, scaled to `amplitude` peak to peak; see `triangle`.

    >>> from rapi_jax import multisine
    >>> (drive,) = multisine(10.0, amplitude=4.5, bias=3.0, harmonics=(1, 3), samples=200)
    >>> drive.waveform, round(drive.u_pp, 6)
    ('multisine', 4.5)
    """
    order = np.arange(len(harmonics))
    phases = -np.pi * order * (order + 1) / len(harmonics)
    number = np.asarray(harmonics, dtype=float)

    def raw(cycles: np.ndarray) -> np.ndarray:
        return np.cos(2.0 * np.pi * cycles[:, None] * number + phases).sum(axis=1)

    fine = np.arange(8192) / 8192
    one = raw(fine)
    low, high, at = float(one.min()), float(one.max()), float(fine[np.argmin(one)])

    def shape(cycles: np.ndarray) -> np.ndarray:
        return 2.0 * (raw(cycles + at) - low) / (high - low) - 1.0

    return _periodic(frequencies, shape, "multisine", amplitude, bias, samples, periods)


def step_and_hold(
    levels: Sequence[float], *, hold_s: float, rise_s: float, step_s: float
) -> tuple[Drive, ...]:
    """Levels (V) held for `hold_s` each, joined by ramps of `rise_s`, sampled every `step_s`.

    Not periodic. What shows creep.

    >>> from rapi_jax import step_and_hold
    >>> (drive,) = step_and_hold([1.0, 4.0], hold_s=0.5, rise_s=0.01, step_s=1e-3)
    >>> drive.waveform, drive.excitation_hz, float(drive.value[-1])
    ('step', None, 4.0)
    """
    if len(levels) < 2 or not (hold_s > 0 and rise_s > 0 and step_s > 0):
        raise ValueError("`step_and_hold` needs two or more levels and positive times.")
    corners = np.concatenate(
        [[i * (hold_s + rise_s), i * (hold_s + rise_s) + hold_s] for i in range(len(levels))]
    )
    time = np.arange(0.0, corners[-1], step_s)
    value = np.interp(time, corners, np.repeat(np.asarray(levels, dtype=float), 2))
    return (Drive(time, value, None, "step"),)


@takes(drive=Drive)
def repeated(drive: Drive, periods: int) -> Drive:
    """One period of `drive`, `periods` times. Raises `DataError` where it has none.

    >>> from rapi_jax import repeated, triangle
    >>> (period,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=100)
    >>> drive = repeated(period, 3)
    >>> drive.periods, drive.size
    (3, 300)
    """
    if drive.excitation_hz is None or drive.periods < 1:
        raise DataError("Only a drive that repeats can be played again and again.")
    if periods < 1:
        raise ValueError(f"Argument `periods` must be 1 or more, but is {periods}.")
    period = 1.0 / drive.excitation_hz
    count = int(np.sum(drive.time < period * (1 - 1e-9)))
    time, value = drive.time[:count], drive.value[:count]
    return dataclasses.replace(
        drive,
        time=np.concatenate([time + k * period for k in range(periods)]),
        value=np.tile(value, periods),
    )
