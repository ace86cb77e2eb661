"""Effects by where they act: on the drive, on the response, or on it with the drive at hand."""

import abc
from typing import ClassVar

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from ._effect import AbstractEffect


class AbstractDriveEffect(AbstractEffect):
    """Acts on the drive (V), before the operator.

    >>> from rapi_jax.effects import AbstractDriveEffect, ALL
    >>> [effect.name for effect in ALL if issubclass(effect, AbstractDriveEffect)]
    ['quantisation', 'slew_limit', 'saturation', 'amplifier_lowpass']
    """

    @abc.abstractmethod
    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        """The changed drive of one run; `t` is the session's time in s, not always even."""


class AbstractBend(AbstractDriveEffect):
    """A drive effect behind which a drive also bends between samples.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import AbstractBend, Quantisation
    >>> time, drive = jnp.arange(2.0) * 0.001, jnp.array([0.0, 0.4])
    >>> rounded = Quantisation.at(step=0.5)
    >>> isinstance(rounded, AbstractBend)
    True
    >>> [x.round(6).tolist() for x in rounded.between(time, drive)]  # 0.5 V from 0.625 ms on
    [[0.0, 0.5], [0.00025], [0.0]]
    """

    @abc.abstractmethod
    def between(
        self, t: Float[Array, " time"], u: Float[Array, " time"]
    ) -> tuple[Float[Array, " time"], Float[Array, " steps"], Float[Array, " steps"]]:
        """The changed drive of one run; and when it bends in each step, s, with its value then."""

    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        """On the samples alone."""
        return self.between(t, u)[0]


class AbstractFollower(AbstractDriveEffect):
    """A drive effect whose state is its output, so that it can continue from any value.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import AbstractFollower, SlewLimit
    >>> limited = SlewLimit.at(limit=500.0)  # V/s
    >>> time, drive = jnp.arange(3.0) * 0.001, jnp.array([2.0, 2.0, 2.0])
    >>> limited.follow(time, drive, jnp.array(1.0)).tolist()  # from an output of 1 V
    [1.0, 1.5, 2.0]
    """

    @abc.abstractmethod
    def follow(
        self, t: Float[Array, " time"], u: Float[Array, " time"], start: Float[Array, ""]
    ) -> Float[Array, " time"]:
        """The changed drive of one run, `start` at its first sample."""

    def follow_between(
        self, t: Float[Array, " time"], u: Float[Array, " time"], start: Float[Array, ""]
    ) -> tuple[Float[Array, " time"], Float[Array, " steps"], Float[Array, " steps"]]:
        """The same, and when in each step it bends, s, with its value then.

        The step's end where it does not; here nowhere.
        """
        value = self.follow(t, u, start)
        return value, t[1:], value[1:]

    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        """From rest at the first value."""
        return self.follow(t, u, u[0])


class AbstractOpticalEffect(AbstractEffect):
    """Acts on the response (GHz), after the operator.

    >>> from rapi_jax.effects import AbstractOpticalEffect, ALL
    >>> [effect.name for effect in ALL if issubclass(effect, AbstractOpticalEffect)]
    ['delay', 'creep', 'resonance', 'drift', 'mode_hop', 'etalon', 'pickup']
    """

    @abc.abstractmethod
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The changed response of one run; `t` is the session's time in s, not always even."""


class AbstractSwitch(AbstractOpticalEffect):
    """Adds `size` (GHz) while on; switches where the response crosses thresholds.

    No model of the response predicts the instant of a switch to a fraction of a sample.

    >>> from rapi_jax.effects import AbstractSwitch, ModeHop
    >>> isinstance(ModeHop(), AbstractSwitch)
    True
    """

    smooth: ClassVar[bool] = False
    size: eqx.AbstractVar[Float[Array, ""]]

    @abc.abstractmethod
    def with_states(
        self,
        nu: Float[np.ndarray, " samples"],
        on: Bool[np.ndarray, " samples"],
        run: Int[np.ndarray, " samples"],
    ) -> "AbstractSwitch":
        """The same effect with the thresholds that best reproduce the given states `on`.

        `nu`: the response before the effect, GHz, run after run; `run`: run number of each sample.
        """


class AbstractCouplingEffect(AbstractEffect):
    """Acts on the response (GHz), as a function of the drive that was sent.

    `steady`: whether the response to a periodic drive is periodic.

    >>> from rapi_jax.effects import AbstractCouplingEffect, CurrentCoupling
    >>> isinstance(CurrentCoupling(), AbstractCouplingEffect)
    True
    """

    steady: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"], u: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The changed response of one run; `u` (V) is the drive sent."""


class AbstractInvertible(eqx.Module):
    """An effect with an inverse, so that a drive can compensate for it.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Etalon
    >>> etalon, nu = Etalon.at(amplitude=0.3, spacing=5.0), jnp.linspace(0.0, 20.0, 9)  # GHz
    >>> bool(jnp.allclose(etalon.inverse(nu, etalon(nu, nu)), nu))
    True
    """

    @abc.abstractmethod
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal that this effect changes into `signal`: one period, repeated for ever.

        `t` is even. Raises `NotInvertible` where there is none.
        """
