"""Pickup: a disturbance at a fixed frequency in time, such as mains, acoustics, a fan."""

from collections.abc import Iterable
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractOpticalEffect
from .base._contribution import Contribution
from .base._first_guess import find_peaks, residual_power
from .base._residual_summary import ResidualSummary

_LOW, _HIGH = 0.01, 1e6  # Hz
_LINE = (50.0, 60.0, 100.0, 120.0, 150.0, 180.0)  # Hz


class Pickup(AbstractOpticalEffect):
    r"""A tone in the session's time: $\nu + A (\sin\theta + s \sin 3\theta + c \cos 3\theta)$.

    $\theta = 2\pi f t + \phi$. `amplitude` is $A$, `hertz` $f$, `phase` $\phi$ in rad; `third_sine`
    and `third_cosine` $s$ and $c$: a distorted mains line is half-wave symmetric, so its harmonics
    are odd. It depends on time alone, so runs must have their times in the session (`start_s`), and
    no periodic drive compensates it.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Pickup
    >>> time = jnp.array([0.0, 0.005, 0.01])  # s; half a period of the mains
    >>> Pickup.at(amplitude=0.2, hertz=50.0)(time, jnp.zeros(3)).round(3).tolist()  # GHz
    [0.0, 0.2, 0.0]
    """

    name: ClassVar[str] = "pickup"
    label: ClassVar[str] = "pickup at a fixed frequency in time"
    pointwise: ClassVar[bool] = True
    signature_axis: ClassVar = "session"
    remedy: ClassVar[str] = (
        "Find the source by its frequency: mains, pump, fan; shield or decouple."
    )
    amplitude: Float[Array, ""] = parameter(unit="{x}", default=0.0)  # A
    hertz: Float[Array, ""] = parameter(unit="Hz", default=50.0, bounds=(_LOW, _HIGH))  # f
    phase: Float[Array, ""] = parameter(unit="rad", default=0.0)  # phi
    third_sine: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(-1.0, 1.0))  # s
    third_cosine: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(-1.0, 1.0))  # c

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        angle = 2.0 * jnp.pi * self.hertz * t + self.phase
        third = self.third_sine * jnp.sin(3.0 * angle) + self.third_cosine * jnp.cos(3.0 * angle)
        return nu + self.amplitude * (jnp.sin(angle) + third)

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """Harmonics of its frequency; also where that was the second or third harmonic itself.

        Whatever disturbs at a fixed rate, by pulses or in any other way, is a sum of them.
        """
        order = np.arange(1, THRESHOLDS.pickup_harmonics + 1)[:, None]
        sets = []
        for line in (float(self.hertz) / part for part in (1, 2, 3)):
            if line >= THRESHOLDS.pickup_lowest_line:
                angle = 2.0 * np.pi * line * order * here.time
                sets.append(here.rms * np.concatenate([np.sin(angle), np.cos(angle)]))
        return sets

    def log_prior(self) -> float:
        """Mains, fans, pumps and sound are faster than what regulation and drift do."""
        slow = float(self.hertz) < THRESHOLDS.pickup_lowest_line
        return -float(np.log(THRESHOLDS.slow_pickup_odds)) if slow else 0.0

    def signature_period(self) -> float:
        return 1.0 / float(self.hertz)

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[Pickup]":
        """The strongest lines of the residual and its non-synchronous part, at four phases."""
        whole = _find_lines(summary, summary.residual, THRESHOLDS.pickup_lines)
        free = _find_lines(summary, _nonsynchronous_residual(summary), THRESHOLDS.pickup_lines)
        line = np.array(_LINE)
        share = summary.sines(summary.time, line)
        best = [*free, *whole, *line[np.argsort(-share, kind="stable")[: THRESHOLDS.pickup_lines]]]
        close = 0.5 / max(summary.duration_s, 1e-6)
        slip = THRESHOLDS.pickup_slip / max(summary.duration_s, 1e-6)
        slowest = THRESHOLDS.pickup_least_cycles / max(summary.recorded_s, 1e-12)
        hertz: list[float] = []
        for f in best:
            # What repeats with every scan is no tone of its own.
            locked = all(_is_harmonic(f, rate, slip) for rate in summary.rates or (0.0,))
            # Of less than a cycle nothing tells a tone from drift, or from the hysteresis.
            if f >= slowest and not locked and all(abs(f - other) > close for other in hertz):
                hertz.append(float(np.clip(f, 2 * _LOW, _HIGH / 2)))
        sizes = np.sqrt(
            2.0 * np.maximum(summary.sines(summary.time, hertz), 1e-6) * residual_power(summary)
        )
        return [
            cls.at(amplitude=a, hertz=f, phase=phase)
            for f, a in zip(hertz, sizes, strict=True)
            for phase in np.arange(4) * np.pi / 2
        ]


def _is_harmonic(hertz: float, rate: float, slip: float) -> bool:
    """Whether a frequency is a multiple of a scan rate, to within `slip` (Hz)."""
    order = round(hertz / rate) if rate > 0 else 0
    return bool(order > 0 and abs(hertz - order * rate) < slip)


def _find_lines(summary: ResidualSummary, residual: np.ndarray, count: int) -> list[float]:
    """Frequencies (Hz) at which a sine over the session explains most of `residual`."""
    from scipy.fft import next_fast_len, rfft, rfftfreq

    lasts, step = summary.duration_s, summary.step_s
    if not (lasts > 0 and step > 0):
        return []
    # Runs may be sampled at other rates than the fastest, and begin between two of its readings.
    nyquist = 0.5 / step
    finest = min(step, 1.0 / THRESHOLDS.pickup_highest)
    step = max(THRESHOLDS.pickup_high * finest, lasts / THRESHOLDS.pickup_cells)
    cell = np.round((summary.time - summary.time.min()) / step).astype(int)
    size = int(cell.max()) + 1
    level = np.zeros(size)
    for k in np.unique(summary.run):
        mine = summary.run == k
        np.add.at(level, cell[mine], residual[mine] - residual[mine].mean())
    # Padded to four sessions: phases at a peak are then right to pi / 8 at either end.
    padded: int = next_fast_len(4 * size, real=True)  # pyright: ignore[reportAssignmentType]
    height = np.abs(np.asarray(rfft(level.astype(np.float32), n=padded))) ** 2  # for peaks alone
    hertz = np.asarray(rfftfreq(padded, step))
    # Less than a cycle a session is drift; near the clock's limit a cell is no instant.
    highest = min(THRESHOLDS.pickup_high / step, max(nyquist, THRESHOLDS.pickup_highest))
    height[(hertz < 1.0 / lasts) | (hertz > highest) | (hertz < 2 * _LOW)] = 0.0
    seen = int(np.searchsorted(hertz, min(nyquist, highest), side="right"))
    peaks = find_peaks(height[:seen], count, apart=THRESHOLDS.pickup_apart)
    # Beyond what one run's readings tell, runs agree on one frequency, and on no other so well.
    beyond = seen + int(np.argmax(height[seen:])) if seen < height.size else 0
    if height[beyond] > THRESHOLDS.pickup_alias * max((height[i] for i in peaks), default=0.0):
        peaks = [beyond, *peaks[: count - 1]]
    return [float(hertz[i]) for i in peaks if height[i] > 0]


def _nonsynchronous_residual(summary: ResidualSummary) -> np.ndarray:
    """The residual less its mean at each phase of the scan, in runs of two periods and more."""
    rest = summary.residual.copy()
    for i, k in enumerate(np.unique(summary.run)):
        mine = np.flatnonzero(summary.run == k)
        time = summary.time[mine] - summary.time[mine[0]]
        rate = summary.rates[i] if i < len(summary.rates) else 0.0
        periods = rate * (time[-1] + summary.step_s)
        if periods < THRESHOLDS.pickup_periods:
            rest[mine] = 0.0  # no second period to take a mean over
            continue
        bins = max(8, min(200, int(mine.size / periods / 4)))
        phase = np.minimum((np.mod(time * rate, 1.0) * bins).astype(int), bins - 1)
        count = np.maximum(np.bincount(phase, minlength=bins), 1)
        rest[mine] -= (np.bincount(phase, weights=rest[mine], minlength=bins) / count)[phase]
    return rest
