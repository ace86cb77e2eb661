"""A simulated motor that tunes a laser: it goes to one place after another, at one speed."""

import math
from collections.abc import Callable


class Motor:
    """Where it is, nm, follows from `clock` (s) and what it was told last."""

    def __init__(self, at_nm: float, speed_nm_s: float, clock: Callable[[], float]) -> None:
        self._at_nm, self._goals = at_nm, [at_nm]
        self._speed = speed_nm_s
        self._clock = clock
        self._updated_s = clock()

    def place(self) -> float:
        """Where it is now, nm."""
        now = self._clock()
        left = max(now - self._updated_s, 0.0) * self._speed
        self._updated_s = now
        while self._goals and left > 0:
            way = self._goals[0] - self._at_nm
            step = min(abs(way), left)
            self._at_nm += math.copysign(step, way)
            left -= step
            if step == abs(way):
                self._at_nm = self._goals.pop(0)
        return self._at_nm

    def go(self, speed_nm_s: float, *goals: float) -> None:
        """Go to each of `goals`, from where it is."""
        self.place()
        self._speed, self._goals = speed_nm_s, list(goals)

    def stop(self) -> None:
        """Stay where it is."""
        self.place()
        self._goals = []

    def moves(self) -> bool:
        """Whether it is on its way."""
        self.place()
        return bool(self._goals)
