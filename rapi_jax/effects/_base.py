"""Where an effect acts is its type: on the drive before the operator, or on the response after."""

import abc

import equinox as eqx
from jaxtyping import Array, Float


class AbstractEffect(eqx.Module):
    """A differentiable change of a signal, the identity at its default parameters."""

    @abc.abstractmethod
    def __call__(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The changed signal; `t` is the session's time in s."""


class AbstractDriveEffect(AbstractEffect):
    """Acts on the drive (V), before the operator."""


class AbstractOpticalEffect(AbstractEffect):
    """Acts on the response (GHz), after the operator."""


class AbstractInvertible(eqx.Module):
    """What an effect also is where it can be undone, so that a drive can allow for it."""

    @abc.abstractmethod
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal that this effect changes into `signal`: one period, repeated for ever."""
