"""Creep: the slow part of a piezo's answer, logarithmic in time."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameter import parameter
from .._precision import float64
from ._base import AbstractInvertible, AbstractLinearEffect, AbstractOpticalEffect, Modes
from ._evidence import Evidence
from ._lags import from_rest, undo_linear

FASTEST_S, SLOWEST_S = 5e-3, 20.0
# Two a decade: in between, the answer to a step grows as its logarithm to 3 parts in 1000.
TAU_S = np.geomspace(FASTEST_S, SLOWEST_S, 8)
_A_DECADE = 7.0 / np.log10(SLOWEST_S / FASTEST_S)


class Creep(AbstractOpticalEffect, AbstractLinearEffect, AbstractInvertible):
    r"""Slow relaxation: $\nu + \frac{g}{K} \sum_k (L_k[\nu] - \nu)$, $L_k$ a lag by $\tau_k$.

    The lags stand $K$ a decade from 5 ms to 20 s. After a step of 1 the answer jumps at once to
    $1 - g N/K$ ($N$ lags, $N/K$ = 4.1), grows as $1 + g \log_{10}(t/t_s)$, $t_s$ = 20.3 s, while
    10 ms < t < 2 s (its slope within 6 % of $g$ a decade), levels off, and ends at 1: the operator
    is what the device answers when all has settled.

    The usual form is $\nu + g' \frac{1}{K} \sum_k L_k[\nu - \nu_{rest}]$, with an operator that is
    the answer before any creep. Both are one family: $g' = g / (1 - g N/K)$, and the operator about
    the resting point is larger here by $1 + g' N/K$. An operator's own gain thus changes where
    creep is added to it, by some 4 g.

    `gain` is that of a decade in time, as a share of the settled answer. `history` says what was
    before the session: 0 a rest at the first value, 1 a long drive as in the first run. The lags
    outlast a run, and go on from one to the next by their times in the session.

    Creep as a sum of first-order lags: Actuators 13, 534.
    """

    name: ClassVar[str] = "creep"
    session: ClassVar[bool] = True
    gain: Float[Array, ""] = parameter(unit="1/decade", default=0.0, bounds=(-0.02, 0.2))  # g
    history: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(0.0, 1.0))

    @float64
    def modes(self) -> Modes:
        return Modes(jnp.asarray(TAU_S), jnp.full(TAU_S.shape, self.gain / _A_DECADE))

    def settled(self) -> Float[Array, ""]:
        return self.history

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The response of one run that begins at rest."""
        return from_rest(self.modes(), t, nu)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return undo_linear(self.modes(), t, signal)

    @classmethod
    def trials(cls, evidence: Evidence) -> "list[Creep]":
        del evidence  # the size is a share of the response, and the time scales are the piezo's
        return [cls.at(gain=g, history=h) for g in (0.01, 0.04) for h in (0.05, 0.95)]
