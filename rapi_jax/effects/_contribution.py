"""What an effect adds along a recording, from which other forms of its mechanism are built."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class Contribution(NamedTuple):
    """Samples of all runs, one after the other.

    - `time`: s in the session. `drive`: V. `added`: by the effect, in the response's unit.

    >>> import numpy as np
    >>> from rapi_jax.effects import Contribution
    >>> drive = np.array([0.0, 1.0, 2.0])
    >>> added = Contribution(np.arange(3.0), drive, np.full(3, 0.1))
    >>> added.by_height(2).round(2).tolist()  # GHz; by the drive's height, and its square
    [[-0.1, 0.0, 0.1], [0.1, -0.05, 0.1]]
    """

    time: Float[np.ndarray, " samples"]
    drive: Float[np.ndarray, " samples"]
    added: Float[np.ndarray, " samples"]

    @property
    def rms(self) -> float:
        """Of what is added, in the response's unit."""
        return float(np.sqrt(np.mean(self.added**2)))

    def by_height(self, degree: int) -> Float[np.ndarray, "functions samples"]:
        """What is added, times Legendre polynomials of the drive's height: all but the constant."""
        low, high = float(self.drive.min()), float(self.drive.max())
        height = 2.0 * (self.drive - low) / max(high - low, 1e-300) - 1.0
        legendre = np.polynomial.legendre.legvander(height, degree)
        return self.added * legendre[:, 1:].T
