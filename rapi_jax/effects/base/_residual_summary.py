"""The residual of the base model in summary, from which effects choose their initial guesses."""

import dataclasses
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from ._linear_path import LinearPath


@dataclasses.dataclass(frozen=True, eq=False)
class ResidualSummary:
    """Samples of all runs, one after the other, and their residual under the base model.

    - `time`: s in the session. `drive`: V. `response`: of the base model, in the response's unit.
    - `residual`: data less base model. `run`: number of the run of each sample.
    - `rates`: Hz, of each run. `u_pp`: V, of each run. `step_s`: the shortest sampling interval.
    - `noise`: rms of the noise of one sample. `span`: of the response.
    - `places`: where one more effect may act on the drive, where others are known: the drive there,
      V, and what linear effects do behind. Else nowhere but at `drive` itself.

    >>> import numpy as np
    >>> from rapi_jax.effects import ResidualSummary
    >>> time = np.arange(200) / 2000.0  # s
    >>> drive = 3.0 - 2.0 * np.cos(2 * np.pi * 20.0 * time)
    >>> summary = ResidualSummary(
    ...     time, drive, 18.0 * drive, 0.1 * np.sin(314.0 * time), np.zeros(200, int),
    ...     rates=(20.0,), u_pp=(4.0,), step_s=1 / 2000, noise=0.02, span=72.0,
    ... )
    >>> round(summary.duration_s, 4), len(summary.lags)
    (0.0995, 4)
    """

    time: Float[np.ndarray, " samples"]
    drive: Float[np.ndarray, " samples"]
    response: Float[np.ndarray, " samples"]
    residual: Float[np.ndarray, " samples"]
    run: Int[np.ndarray, " samples"]
    rates: tuple[float, ...]
    u_pp: tuple[float, ...]
    step_s: float
    noise: float
    span: float
    places: tuple[tuple[Float[np.ndarray, " samples"], LinearPath | None], ...] = ()

    @property
    def duration_s(self) -> float:
        """From the first sample of the session to the last, s."""
        return float(self.time.max() - self.time.min())

    @property
    def recorded_s(self) -> float:
        """How long all runs last together, without the pauses between them, s."""
        runs = [self.time[self.run == k] for k in np.unique(self.run)]
        return sum(float(time.max() - time.min()) for time in runs) + len(runs) * self.step_s

    @property
    def lags(self) -> tuple[float, ...]:
        """Four times, s, from 1/2000 to 1/25 of the shortest period, to start lags and delays from.

        Where nothing repeats, the mean length of a run stands for the period.
        """
        fastest = max(self.rates, default=0.0)
        period = 1.0 / fastest if fastest > 0 else self.duration_s / max(len(self.rates), 1)
        if not period > 0:
            return ()
        return tuple(min(period / part, 0.15) for part in (2000.0, 500.0, 100.0, 25.0))

    @property
    def slope(self) -> float:
        """Typical slope of the response in time, per s; zero for one that never changes."""
        inside = self.run[1:] == self.run[:-1]
        step = np.diff(self.time)[inside]
        rise = np.abs(np.diff(self.response)[inside])
        good = step > 0
        return float(np.median(rise[good] / step[good])) if good.any() else 0.0

    def sines(
        self, x: Float[np.ndarray, " samples"], cycles: Sequence[float] | np.ndarray
    ) -> Float[np.ndarray, " cycles"]:
        """Fraction of the residual's power in a sine of `x`, for each number of cycles a unit.

        The mean of each run is subtracted first. Sines are only nearly orthogonal to a constant, so
        this serves for first guesses alone.
        """
        runs = np.unique(self.run)
        rest = self.residual.copy()
        for run in runs:
            rest[self.run == run] -= rest[self.run == run].mean()
        power = float(rest @ rest)
        out = np.zeros(len(cycles))
        if power == 0:
            return out
        for i, cycle in enumerate(cycles):
            wave = np.exp(2j * np.pi * cycle * x)
            out[i] = 2.0 * np.abs(wave @ rest) ** 2 / (rest.size * power)
        return out
