"""A laser's frequency and power over a stretch of time that repeats."""

import dataclasses
from functools import cached_property

import numpy as np

_MOST_PERIODS = 64  # copied one after the other; beyond, samples are looked up one by one


@dataclasses.dataclass(frozen=True, eq=False)
class Scan:
    """The laser's frequency over a stretch of time that repeats for ever.

    - `nu`: GHz, in even steps; `periods`: of the drive in it.
    - `held`: each value lasts a whole step (a static device behind a generator); otherwise values
      stand in the middle of their steps and are joined by straight lines.
    - `power`: of the light at the same steps, relative; `None` where it does not change.
    """

    nu: np.ndarray
    rate_hz: float
    periods: int
    held: bool
    power: np.ndarray | None = None

    @property
    def steps_per_s(self) -> float:
        """Values a second."""
        return self.nu.size / self.periods * self.rate_hz

    @cached_property
    def light(self) -> "Scan | None":
        """The power in place of the frequency; `None` where it does not change."""
        return None if self.power is None else dataclasses.replace(self, nu=self.power, power=None)

    @cached_property
    def _rise(self) -> np.ndarray:
        return np.append(np.diff(self.nu), self.nu[0] - self.nu[-1])

    def even(self, start_s: float, step_s: float, count: int) -> np.ndarray:
        """Frequency at `count` times, `step_s` apart from `start_s` after the drive's start, GHz.

        As `at` gives it, but for rounding, and several times as fast.
        """
        place = np.arange(count) * (step_s * self.steps_per_s)
        place += (start_s * self.steps_per_s - (not self.held) * 0.5) % self.nu.size
        index = place.astype(np.int64)
        if index[-1] > _MOST_PERIODS * self.nu.size:
            return self._far(place, index)
        nu = np.take(self.nu, index, mode="wrap")
        if not self.held:
            place -= index
            place *= np.take(self._rise, index, mode="wrap")
            nu += place
        return nu

    def at(self, time: np.ndarray) -> np.ndarray:
        """Frequency at times after the drive's start (s, increasing), GHz."""
        place = time * self.steps_per_s
        if not self.held:
            place -= 0.5
        place -= self.nu.size * np.floor(place[0] / self.nu.size)
        index = place.astype(np.int64)  # positive: the same as rounding down
        more = int(index[-1]) // self.nu.size + 1
        if more > _MOST_PERIODS:
            return self._far(place, index)
        nu = np.tile(self.nu, more) if more > 1 else self.nu
        if self.held:
            return nu[index]
        place -= index
        here = nu[index]
        there = np.append(nu, nu[0])[index + 1]
        there -= here
        there *= place
        there += here
        return there

    def _far(self, place: np.ndarray, index: np.ndarray) -> np.ndarray:
        """`at` and `even` over many periods, without a copy of each.

        NumPy's "wrap" takes one period off at a time.
        """
        within = index % self.nu.size
        nu = self.nu[within]
        return nu if self.held else nu + (place - index) * self._rise[within]
