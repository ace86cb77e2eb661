"""What an effect adds along a recording, from which other forms of its mechanism are built."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float


class Contribution(NamedTuple):
    """Samples of all runs, one after the other.

    - `time`: s in the session. `drive`: V. `added`: by the effect, in the response's unit.

    >>> import numpy as np
    >>> from rapi_jax.effects import Contribution
    >>> added = Contribution(np.arange(4.0), np.zeros(4), np.array([0.1, -0.1, 0.1, -0.1]))
    >>> round(added.rms, 3)  # GHz
    0.1
    """

    time: Float[np.ndarray, " samples"]
    drive: Float[np.ndarray, " samples"]
    added: Float[np.ndarray, " samples"]

    @property
    def rms(self) -> float:
        """Of what is added, in the response's unit."""
        return float(np.sqrt(np.mean(self.added**2)))
