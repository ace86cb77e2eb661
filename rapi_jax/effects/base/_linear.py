"""Linear effects: transfer functions, and sums of first-order lags."""

import abc
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Inexact

from ._effect import AbstractEffect


class Modes(NamedTuple):
    r"""A linear system as first-order lags: $x + \mathrm{Re}\sum_k c_k (L_k[x] - x)$.

    $L_k$ is the solution of $\tau_k \dot L = x - L$. With `tau` = 0 a mode passes its input; with
    weights 0 the system is the identity. At rest the output equals the input for any weights.

    `tau`: s, shape `modes`, real part not negative. `weight`: 1, shape `modes`. A pair of complex
    modes is named once, with twice the weight. Both real (which is faster) or both complex.

    >>> from rapi_jax.effects import AmplifierLowpass
    >>> modes = AmplifierLowpass.at(tau=1e-4).modes()
    >>> modes.tau.real.tolist(), modes.weight.real.tolist()  # s; 1
    ([0.0001], [1.0])
    """

    tau: Inexact[Array, " modes"]
    weight: Inexact[Array, " modes"]


class Past(NamedTuple):
    """The state before the runs of a session, of a linear effect whose memory outlasts a run.

    - `settled`: from rest (0) to a drive that has long been that of the first run (1), before it.
    - `rest`: the signal while nothing is driven, counted from the first run's first value, as a
      share of that run's range.
    - `lead_s`: for how long each run's drive has been on when its first sample is taken, after a
      rest; beyond `ALWAYS_ON_S` there is no rest: a run's drive is on from the end of the run
      before, and the first one's begins with its first sample.
    - `lead_periods`: for how many periods besides, of a run that repeats.
    """

    settled: Float[Array, ""]
    rest: Float[Array, ""]
    lead_s: Float[Array, ""]
    lead_periods: Float[Array, ""]

    @classmethod
    def of(cls, settled: float) -> "Past":
        """No rests between runs; `settled` before the first."""
        zero = jnp.zeros(())
        return cls(jnp.asarray(settled), zero, jnp.asarray(2.0 * ALWAYS_ON_S), zero)


ALWAYS_ON_S = 1e4


class AbstractLinearEffect(AbstractEffect):
    """A linear time-invariant effect; second base beside the type that says where it acts.

    >>> import numpy as np
    >>> from rapi_jax.effects import Delay
    >>> delayed = Delay.at(tau=1e-3).transfer(np.array([250.0]))  # Hz
    >>> round(float(np.degrees(np.angle(delayed[0]))), 6)
    -90.0
    """

    @abc.abstractmethod
    def transfer(self, hertz: Float[np.ndarray, " freq"]) -> Complex[np.ndarray, " freq"]:
        """The transfer function at frequencies in Hz, of concrete parameters."""


class AbstractLagEffect(AbstractLinearEffect):
    """A linear effect that is a sum of first-order lags, which share one recursion.

    `session`: whether its memory outlasts a run, so that the runs of a session are one history.

    >>> from rapi_jax.effects import Creep
    >>> Creep.at(gain=0.01).modes().tau.shape  # its first-order lags
    (8,)
    """

    session: eqx.AbstractClassVar[bool]

    @abc.abstractmethod
    def modes(self) -> Modes:
        """Time constants and weights of the lags."""

    @abc.abstractmethod
    def past(self) -> Past:
        """The state before the runs, where the memory outlasts them."""

    def transfer(self, hertz: Float[np.ndarray, " freq"]) -> Complex[np.ndarray, " freq"]:
        modes = jax.tree_util.tree_map(np.asarray, _compiled_modes(self))
        return np.asarray(transfer(modes, hertz))


@jax.jit
def _compiled_modes(effect: AbstractLagEffect) -> Modes:
    return effect.modes()


def transfer(modes: Modes, hertz: Float[Array | np.ndarray, " freq"]) -> Any:
    """The transfer function of `modes` at the given frequencies, Hz: of NumPy or JAX arrays."""
    tau, weight = modes.tau.astype(complex), modes.weight.astype(complex) / 2.0
    s = 2j * np.pi * hertz.astype(complex)
    lag = 1.0 / (1.0 + s[:, None] * tau[None, :]) - 1.0
    mirror = 1.0 / (1.0 + s[:, None] * tau.conj()[None, :]) - 1.0
    return 1.0 + lag @ weight + mirror @ weight.conj()
