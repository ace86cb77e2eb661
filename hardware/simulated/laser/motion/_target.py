"""A target: where it stands, how it moves, and its distance at the samples of a record."""

import dataclasses
import functools

import numpy as np

from ._base import AbstractMotion

# Six-point interpolation errs by 0.005 (omega h)^6: at 0.1 by 5e-9 of an amplitude, which is 1e-6
# rad of phase for 20 um at 780 nm.
_STEP_RAD = 0.1
_FEWEST = 8  # samples between nodes, below which each sample is evaluated


@dataclasses.dataclass(frozen=True)
class Target:
    """What the measurement arm looks at: `distance_m` plus the sum of `motions`, m.

    Motions are added: `Target(0.7) + Vibration(1e-6, 50.0) + ConstantVelocity(5e-3)`.
    """

    distance_m: float
    motions: tuple[AbstractMotion, ...] = ()

    def __post_init__(self) -> None:
        if not (np.isfinite(self.distance_m) and self.distance_m >= 0):
            raise ValueError(f"`distance_m` must be zero or positive, but is {self.distance_m}.")

    def __add__(self, motion: AbstractMotion) -> "Target":
        """The same target with one more motion."""
        return dataclasses.replace(self, motions=(*self.motions, motion))

    def distance(self, session_s: np.ndarray | float) -> np.ndarray:
        """Distance at session times (s), m: the truth that a reading can be judged by."""
        time = np.asarray(session_s, dtype=float)
        return np.asarray(self.distance_m + self._moved(time.reshape(-1)).reshape(time.shape))

    def displacement(self, start_s: float, sample_hz: float, count: int) -> np.ndarray | None:
        """Displacement at `count` even times from session time `start_s` on, m; `None` at rest.

        Evaluated on nodes and interpolated, to 1e-6 rad of the light's phase; sample by sample
        where a motion has a kink.
        """
        if not self.motions:
            return None
        spacing = self._spacing(sample_hz, count)
        intervals = -(-count // spacing)
        nodes_s = start_s + np.arange(-2, intervals + 4) * (spacing / sample_hz)
        ends = float(nodes_s[0]), float(nodes_s[-1])
        if spacing < _FEWEST or any(motion.has_kink(*ends) for motion in self.motions):
            return self._moved(start_s + np.arange(count) / sample_hz)
        windows = np.lib.stride_tricks.sliding_window_view(self._moved(nodes_s), 6)[:intervals]
        return (windows @ _weights(spacing)).reshape(-1)[:count]

    def _spacing(self, sample_hz: float, count: int) -> int:
        highest = max(motion.highest_hz for motion in self.motions)
        if highest == 0.0:
            return count
        return max(1, int(min(count, _STEP_RAD * sample_hz / (2.0 * np.pi * highest))))

    def _moved(self, session_s: np.ndarray) -> np.ndarray:
        total = np.zeros(session_s.shape)
        for motion in self.motions:
            total += motion.at(session_s)
        return total


@functools.lru_cache(maxsize=4)
def _weights(spacing: int) -> np.ndarray:
    """Lagrange's weights (6, spacing) of the values at nodes -2 to 3 between nodes 0 and 1."""
    nodes, place = np.arange(-2, 4), np.arange(spacing) / spacing
    rows = []
    for here in nodes:
        others = nodes[nodes != here]
        rows.append(np.prod((place[:, None] - others) / (here - others), axis=1))
    return np.array(rows)
