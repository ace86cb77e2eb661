"""A motion along the measurement arm: a displacement at each session time."""

import abc

import numpy as np


class AbstractMotion(abc.ABC):
    """A displacement (m) that is a function of session time (s) and of its own fields alone.

    Records of one session therefore see one motion, whatever their lengths and gaps.
    """

    @property
    @abc.abstractmethod
    def highest_hz(self) -> float:
        """Highest frequency in it, Hz; between kinks it is smooth on this scale."""

    @abc.abstractmethod
    def at(self, session_s: np.ndarray) -> np.ndarray:
        """Displacement at session times (s), m."""

    @abc.abstractmethod
    def has_kink(self, start_s: float, stop_s: float) -> bool:
        """Whether its value or a derivative jumps between two session times."""
