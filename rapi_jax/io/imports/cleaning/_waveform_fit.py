"""The triangle or sine that lies nearest to a measured drive, by least squares."""

import dataclasses
from typing import Literal

import numpy as np
from jaxtyping import Float

from rapi_jax.io.imports._thresholds import THRESHOLDS
from rapi_jax.recording._drive import Drive

Samples = Float[np.ndarray, " samples"]


@dataclasses.dataclass(frozen=True)
class FittedWaveform:
    """A triangle or a sine: `phase` periods after its minimum at the time 0.

    `amplitude`: peak to peak, and `offset`: its middle, in the drive's unit; `rate`: Hz; `rise`:
    share of the period on the way up, of a triangle.
    """

    waveform: Literal["triangle", "sine"]
    amplitude: float
    offset: float
    rate: float
    phase: float
    rise: float = 0.5

    def __call__(self, time: Samples) -> Samples:
        """Its values at times, s."""
        shape = _shape(self.waveform, self.rate * time + self.phase, self.rise)
        return self.offset + self.amplitude / 2.0 * shape

    def describe(self, unit: str) -> str:
        """What it is, in words."""
        rise = f", {100 * self.rise:.4g} % of it rising" if self.rise != 0.5 else ""
        return (
            f"a {self.waveform} of {self.amplitude:.6g} {unit} peak to peak centred on "
            f"{self.offset:.6g} {unit} at {self.rate:.8g} Hz, "
            f"{round(self.phase, 5) % 1.0:.5f} of a period after its minimum at the first sample"
            f"{rise}"
        )


def fit_waveform(drive: Drive) -> FittedWaveform | None:
    """The nearest triangle or sine to a drive of that waveform; `None` for another waveform.

    The rate stays as it is said, and a triangle symmetric, unless the readings speak against it.
    """
    if drive.waveform not in ("triangle", "sine") or not drive.periods:
        return None
    whole = np.flatnonzero(drive.period >= 0)  # a broken end may be that of another run
    if drive.periods < THRESHOLDS.few_periods:  # of one, harmonics look like another rate
        whole = np.arange(drive.size)
    used = whole[:: -(-whole.size // THRESHOLDS.waveform_samples)]
    time, value = drive.time[used], drive.value[used]
    rise, phase = _first_guess(drive.waveform, drive.rate * time, value)
    frees = [(rate, rises) for rate in (False, True) for rises in (False, True)]
    if drive.waveform == "sine":
        frees = frees[::2]
    found = [_solve(drive, time, value, phase, rise, free) for free in frees]
    # A parameter more has to lower the sum of squares by more than chance does.
    price = THRESHOLDS.waveform_sigmas**2
    floor = value.size * (1e-12 * drive.u_pp) ** 2
    scores = [
        value.size * np.log(square + floor) + price * sum(free)
        for (square, _), free in zip(found, frees, strict=True)
    ]
    return found[int(np.argmin(scores))][1]


def _shape(waveform: str, cycles: np.ndarray, rise: float) -> np.ndarray:
    """From -1 at the minimum, at whole `cycles`, to 1."""
    if waveform == "sine":
        return -np.cos(2.0 * np.pi * cycles)
    phase = np.mod(cycles, 1.0)
    return 2.0 * np.where(phase < rise, phase / rise, (1.0 - phase) / (1.0 - rise)) - 1.0


def _first_guess(waveform: str, cycles: np.ndarray, value: np.ndarray) -> tuple[float, float]:
    """Rise and phase: each rise with the phase at which the first harmonics agree."""
    tone = np.exp(-2j * np.pi * cycles)
    angle = np.angle(np.mean((value - value.mean()) * tone))
    once = (np.arange(512) + 0.5) / 512
    best = (np.inf, 0.5, 0.0)
    for rise in (0.5,) if waveform == "sine" else np.linspace(0.02, 0.98, 49):
        own = np.angle(np.mean(_shape(waveform, once, rise) * np.exp(-2j * np.pi * once)))
        phase = float((angle - own) / (2.0 * np.pi) % 1.0)
        square = _project(_shape(waveform, cycles + phase, rise), value)[0]
        best = min(best, (square, float(rise), phase))
    return best[1], best[2]


def _project(shape: np.ndarray, value: np.ndarray) -> tuple[float, float, float]:
    """The sum of squares that the best amplitude and offset leave, and those two."""
    centred = shape - shape.mean()
    gain = float(centred @ value) / max(float(centred @ centred), 1e-300)
    left = value - value.mean() - gain * centred
    return float(left @ left), 2.0 * gain, float(value.mean() - gain * shape.mean())


def _solve(
    drive: Drive, time: np.ndarray, value: np.ndarray, phase: float, rise: float,
    free: tuple[bool, bool],
) -> tuple[float, FittedWaveform]:  # fmt: skip
    """The sum of squares and the waveform; `free`: whether the rate and the rise are fitted.

    Phase and rate are told apart by the middle of the record.
    """
    from scipy.optimize import least_squares

    middle = float(time.mean())
    length = float(np.ptp(time))

    def waveform(x: np.ndarray) -> tuple[float, float, float]:
        rate = drive.rate + (x[1] / length if free[0] else 0.0)
        return rate, phase + x[0] - (rate - drive.rate) * middle, x[-1] if free[1] else 0.5

    def left(x: np.ndarray) -> np.ndarray:
        rate, start, up = waveform(x)
        shape = _shape(drive.waveform, rate * time + start, up)
        centred = shape - shape.mean()
        apart = value - value.mean()
        return (apart - float(centred @ apart) / float(centred @ centred) * centred) / drive.u_pp

    first = np.array([0.0, *([0.0] if free[0] else []), *([rise] if free[1] else [])])
    if not free[1]:  # the phase that was guessed belongs to the rise that was guessed
        first[0] = (rise - 0.5) / 2.0 if drive.waveform == "triangle" else 0.0
    bounds = (
        np.array([-0.5, *([-0.5] if free[0] else []), *([0.005] if free[1] else [])]),
        np.array([0.5, *([0.5] if free[0] else []), *([0.995] if free[1] else [])]),
    )
    end = least_squares(left, first, jac="3-point", bounds=bounds, xtol=1e-13, ftol=1e-13).x
    rate, start, up = waveform(end)
    square, amplitude, offset = _project(_shape(drive.waveform, rate * time + start, up), value)
    kind: Literal["triangle", "sine"] = "sine" if drive.waveform == "sine" else "triangle"
    return square, FittedWaveform(
        kind, amplitude, offset, float(rate), float(start % 1.0), float(up)
    )
