"""What a maker of effects is given and what it gives: an effect up to one number, its strength."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from fitting.blind.simulator._scan import Scan
from fitting.blind.simulator._signal_path import Effect

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Setting:
    """The session an effect is drawn for."""

    scans: tuple[Scan, ...]
    clean: tuple[Array, ...]  # GHz, noise-free, without effects
    rest: float  # GHz
    target: float  # GHz, projected rms that is asked for

    @property
    def end_s(self) -> float:
        """End of the session, s."""
        return self.scans[-1].start_s + self.scans[-1].duration_s

    @property
    def widest(self) -> Scan:
        """The run of the largest swing."""
        return max(self.scans, key=lambda scan: scan.swing)

    @property
    def steepest(self) -> float:
        """The largest slope of any drive, V/s."""
        return max(float(np.max(np.abs(np.diff(s.drive)))) / s.step_s for s in self.scans)

    @property
    def pooled(self) -> Array:
        """All noise-free readings in one array, GHz."""
        return np.concatenate(self.clean)


@dataclass(frozen=True, eq=False)
class Recipe:
    """An effect up to its strength, which lies between `low` and `high`."""

    name: str  # as in the list of effects, or unlisted:kind
    strength: str  # what the strength is called
    low: float
    high: float
    build: Callable[[float], Effect]
    parameters: dict[str, Any]

    def settings(self, strength: float) -> dict[str, Any]:
        """All parameters of the effect at one strength."""
        return {**self.parameters, self.strength: strength}


Maker = Callable[[np.random.Generator, Setting], Recipe]


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    """One number whose logarithm is uniform."""
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def path_in_time(horizon: float, grid: Array, values: Array) -> Callable[[Array], Array]:
    """A random path on the session's clock: straight between its points, held after `horizon`."""
    kept = grid <= horizon
    return lambda t: np.interp(t, grid[kept], values[kept])


def drive_range(scans: Sequence[Scan]) -> tuple[float, float]:
    """Least and largest drive of the session, V."""
    return (
        min(s.bias - s.swing / 2 for s in scans),
        max(s.bias + s.swing / 2 for s in scans),
    )
