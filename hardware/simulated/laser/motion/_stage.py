"""A stage that goes from node to node and stops at each within its repeatability."""

import dataclasses
from functools import cached_property
from typing import Literal

import numpy as np

from ._base import AbstractMotion


@dataclasses.dataclass(frozen=True)
class SteppedStage(AbstractMotion):
    """`nodes` nodes, `step_m` apart; at each for `dwell_s`, then on to the next within `move_s`.

    - `start_s`: session time at which it comes to rest at node 0. It stays at the last node.
    - `repeatability_m`: half the range of a node's error where `distribution` is "uniform" (that is
      how +-0.12 um is read here), its standard deviation where it is "normal".
    - `seed`: errors are a function of it and of the node alone.

    Moves have the least jerk (a polynomial of degree 5): velocity and acceleration are continuous.
    """

    step_m: float = 20e-3
    nodes: int = 10
    dwell_s: float = 5.0
    move_s: float = 1.0
    start_s: float = 0.0
    repeatability_m: float = 0.12e-6
    distribution: Literal["uniform", "normal"] = "uniform"
    seed: int = 0

    def __post_init__(self) -> None:
        if not (self.nodes >= 1 and self.dwell_s > 0 and self.move_s > 0):
            raise ValueError(f"A stage needs a node and positive times, unlike {self}.")
        if not self.repeatability_m >= 0:
            raise ValueError(f"`repeatability_m` must not be negative, as in {self}.")

    @property
    def highest_hz(self) -> float:
        """None beyond its moves, which are polynomials."""
        return 0.0

    @cached_property
    def positions_m(self) -> np.ndarray:
        """Where it rests at each node, m: multiples of the step, and errors."""
        draws = [np.random.default_rng([self.seed, node]) for node in range(self.nodes)]
        if self.distribution == "uniform":
            errors = [rng.uniform(-1.0, 1.0) for rng in draws]
        else:
            errors = [rng.standard_normal() for rng in draws]
        return np.arange(self.nodes) * self.step_m + self.repeatability_m * np.array(errors)

    def at(self, session_s: np.ndarray) -> np.ndarray:
        """Displacement, m."""
        cycle = self.dwell_s + self.move_s
        since = np.maximum(session_s - self.start_s, 0.0)
        node = np.minimum((since / cycle).astype(np.int64), self.nodes - 1)
        along = np.clip((since - node * cycle - self.dwell_s) / self.move_s, 0.0, 1.0)
        here, there = self.positions_m[node], self.positions_m[np.minimum(node + 1, self.nodes - 1)]
        return here + (there - here) * along**3 * (10.0 - 15.0 * along + 6.0 * along**2)

    def has_kink(self, start_s: float, stop_s: float) -> bool:
        """Where a move begins and ends."""
        cycle = self.dwell_s + self.move_s

        def corners(at_s: float) -> int:
            since = at_s - self.start_s
            if since < 0:
                return 0
            node = min(int(since / cycle), self.nodes - 1)
            return 2 * node + (since - node * cycle >= self.dwell_s)

        return corners(start_s) != corners(stop_s)
