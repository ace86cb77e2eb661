"""The steps of a digital source."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._parameter import parameter
from .._precision import float64
from ._base import AbstractDriveEffect, AbstractEffect
from ._evidence import Evidence

_BITS = range(6, 15)


class Quantisation(AbstractDriveEffect):
    r"""A drive rounded to whole steps: $u_0 + q\,\mathrm{round}((u - u_0) / q)$.

    A converter of $n$ bits over a range $R$ has $q = R / 2^n$. It cannot be undone; a finer source
    can replace it.
    """

    step: Float[Array, ""] = parameter(unit="{u}", default=0.0, bounds=(0.0, jnp.inf))  # q
    origin: Float[Array, ""] = parameter(unit="{u}", default=0.0, held=True)  # u_0

    name: ClassVar = "quantisation"
    smooth: ClassVar = False

    @classmethod
    def trials(cls, evidence: Evidence) -> list[AbstractEffect]:
        """6 to 14 bits of the drive's range."""
        low, high = float(evidence.drive.min()), float(evidence.drive.max())
        return [cls.at(step=(high - low) / 2**bits, origin=low) for bits in _BITS if high > low]

    @float64
    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        del t
        some = self.step > 0
        step = jnp.where(some, self.step, 1.0)
        return jnp.where(some, self.origin + step * jnp.round((u - self.origin) / step), u)
