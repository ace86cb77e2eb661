"""What the peer is given: runs as arrays, and where parameters lie in one vector.

Without Numba, so that what makes the data can be used where it is not installed.
"""

from typing import NamedTuple

import numpy as np


class Shape(NamedTuple):
    """Where the parts of the parameter vector lie."""

    plays: int
    lams: int  # 1, or one a play
    order: int


class Runs(NamedTuple):
    """Runs as arrays: drive, response and square root of the weight, with what Eq. 11 needs."""

    u: np.ndarray  # "runs time"
    y: np.ndarray  # "runs time"
    weight: np.ndarray  # "runs"
    freq: np.ndarray  # "runs"
    u_pp: np.ndarray  # "runs"
    u_min: np.ndarray  # "runs"
