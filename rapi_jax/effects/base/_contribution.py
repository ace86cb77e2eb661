"""What an effect adds along a recording, from which other forms of its mechanism are built."""

import dataclasses
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

if TYPE_CHECKING:
    from ._effect import AbstractEffect


@dataclasses.dataclass(frozen=True, eq=False)
class Contribution:
    """Samples of all runs, one after the other.

    - `time`: s in the session. `drive`: V. `added`: by the effect; `before`: the response without
      it; both in the response's unit. `run`: the number of each sample's run, from 0.
    - `rates`: of each run, Hz.
    - `beside`: the samples that another effect adds beside this one.

    >>> import numpy as np
    >>> from rapi_jax.effects import Contribution
    >>> time, flat = np.arange(4.0), np.zeros(4)
    >>> added = np.array([0.1, -0.1, 0.1, -0.1])  # GHz
    >>> run = np.zeros(4, dtype=int)
    >>> here = Contribution(time, flat, added, flat, run, np.ones(1), lambda effect: flat)
    >>> round(here.rms, 3)  # GHz
    0.1
    """

    time: Float[np.ndarray, " samples"]
    drive: Float[np.ndarray, " samples"]
    added: Float[np.ndarray, " samples"]
    before: Float[np.ndarray, " samples"]
    run: Int[np.ndarray, " samples"]
    rates: Float[np.ndarray, " runs"]
    beside: "Callable[[AbstractEffect], Float[np.ndarray, ' samples']]"

    @property
    def rms(self) -> float:
        """Of what is added, in the response's unit."""
        return float(np.sqrt(np.mean(self.added**2)))

    def scaled(
        self, functions: Float[np.ndarray, "functions samples"]
    ) -> Float[np.ndarray, "functions samples"]:
        """The functions, by one factor, so that the largest is as large as what is added."""
        largest = float(np.sqrt(np.mean(functions**2, axis=1).max(initial=0.0)))
        return functions * (self.rms / largest) if largest > 0 else functions
