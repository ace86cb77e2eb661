"""Feed-through of the piezo's drive into the diode's current."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameter import parameter
from .._precision import float64
from ._base import AbstractCouplingEffect
from ._evidence import Evidence
from ._size import size


class CurrentCoupling(AbstractCouplingEffect):
    r"""Capacitive feed-through: $\nu + k\,\dot u$, $u$ the drive that is sent.

    `coupling` is $k$, of either sign. The drive is taken as straight between samples: inside a
    straight piece $\dot u$ is its slope, on a corner the mean of both sides. (A part of $u$ itself
    cannot be told from the operator's own gain.) A recorded drive with noise of its own passes that
    noise on: send the drive that was asked for, not the one read back.

    Diode current moves a laser by some 3 MHz/uA (MOGLabs CEL manual); arXiv 1712.06627.
    """

    name: ClassVar[str] = "current_coupling"
    coupling: Float[Array, ""] = parameter(unit="{x} s/{u}", default=0.0)  # k

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"], u: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return nu + self.coupling * slopes(t, u)

    @classmethod
    def trials(cls, evidence: Evidence) -> "list[CurrentCoupling]":
        slope = np.zeros(evidence.time.size)
        for k in np.unique(evidence.run):
            mine = np.flatnonzero(evidence.run == k)
            if mine.size > 1:
                slope[mine] = np.asarray(_slopes(evidence.time[mine], evidence.drive[mine]))
        found = size(evidence, slope)
        return [cls.at(coupling=found), cls.at(coupling=-found)]


@float64
def _slopes(t, u):
    return slopes(jnp.asarray(t), jnp.asarray(u))


def slopes(t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
    """Mean of the slopes before and after each sample; a repeated sample has no side."""
    step = jnp.diff(t)
    moves = step > 0
    slope = jnp.where(moves, jnp.diff(u) / jnp.where(moves, step, 1.0), 0.0)
    none = jnp.zeros(1)
    total = jnp.concatenate([none, slope]) + jnp.concatenate([slope, none])
    sides = moves.astype(u.dtype)
    count = jnp.concatenate([none, sides]) + jnp.concatenate([sides, none])
    return total / jnp.maximum(count, 1.0)
