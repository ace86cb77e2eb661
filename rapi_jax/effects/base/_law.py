"""Effects on the numbers of a run that Eq. 11 and the gain depend on."""

import abc
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from ._effect import AbstractEffect


class Law(NamedTuple):
    """The quantities of a run that Eq. 11 and the gain depend on.

    `freq`: scan rate, Hz. `u_pp`: peak-to-peak drive, V. `gain` multiplies the operator's response
    less its constant; `offset` (response unit) is added.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Law
    >>> law = Law.of(jnp.array(10.0), jnp.array(4.5))  # Hz, V peak to peak
    >>> float(law.gain), float(law.offset)  # the operator's own: 1 and 0
    (1.0, 0.0)
    """

    freq: Float[Array, ""]
    u_pp: Float[Array, ""]
    gain: Float[Array, ""]
    offset: Float[Array, ""]

    @classmethod
    def of(cls, freq: Float[Array, "*runs"], u_pp: Float[Array, "*runs"]) -> "Law":
        """Those of the operator alone: gain 1, offset 0."""
        return cls(freq, u_pp, jnp.ones_like(freq), jnp.zeros_like(freq))

    def after(
        self, response: Float[Array, "*time"], constant: Float[Array, ""]
    ) -> Float[Array, "*time"]:
        """The response with gain and offset applied; `constant` is the operator's own."""
        return constant + self.gain * (response - constant) + self.offset

    def before(
        self, response: Float[Array, "*time"], constant: Float[Array, ""]
    ) -> Float[Array, "*time"]:
        """The operator's response that `after` maps to `response`."""
        return constant + (response - constant - self.offset) / self.gain


class AbstractLawEffect(AbstractEffect):
    """Changes how thresholds and gain follow rate, amplitude and bias (Eq. 11).

    >>> from rapi_jax.effects import AbstractLawEffect, ALL
    >>> [effect.name for effect in ALL if issubclass(effect, AbstractLawEffect)]
    ['rate_law', 'amplitude_law']
    """

    @abc.abstractmethod
    def __call__(self, law: Law, bias: Float[Array, ""]) -> Law:
        """The changed numbers of one run; `bias` (V) is the middle of its drive."""
