"""An operator one sample at a time: the forward model, or the paper's inverse as it is."""

from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from rapi_jax._ecdl import ECDL
from rapi_jax._precision import as_float64, float64
from rapi_jax.operators import AbstractOperator

from ._frozen_operator import FrozenOperator

State = Float[Array, " plays"]


class StreamingOperator(eqx.Module):
    """Drive in, response out; the state is the plays' outputs (Eq. 9).

    With an `InverseRAPI` it is the paper's compensator: frequency in, drive out (Eq. 24).

    >>> import numpy as np
    >>> from rapi_jax import StreamingOperator, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=100)
    >>> model = StreamingOperator.of(paper_device(), 10.0, u_min=0.75, u_pp=4.5)
    >>> _, response = model.run(drive.value)
    >>> float(np.abs(response - predict(paper_device(), drive))[50:].max()) < 1e-9  # GHz
    True
    """

    frozen: FrozenOperator
    low: Float[Array, ""]

    @classmethod
    @float64
    def of(
        cls, model: ECDL | AbstractOperator, freq: Any, *, u_min: Any, u_pp: Any
    ) -> "StreamingOperator":
        """At scan rate `freq` (Hz), for inputs from `u_min` on, `u_pp` peak to peak (Eq. 11).

        Raises `ValueError` where effects stand around the operator.
        """
        return cls(FrozenOperator.of(model, freq, u_pp), as_float64(u_min))

    @float64
    def initial(self) -> State:
        """At rest at the lowest input (Eq. 13)."""
        return self.frozen.rest(self.low)

    @float64
    def step(self, state: State, u: Float[Array, ""]) -> tuple[State, Float[Array, ""]]:
        """The state after, and the response to, one sample; pure."""
        u = u.astype(jnp.float64)
        return self.frozen.clamped(u, state), self.frozen.respond(u, state)[0]

    @float64
    def run(
        self, u: Float[ArrayLike, " time"], state: State | None = None
    ) -> tuple[State, Float[Array, " time"]]:
        """The state after, and the responses to, all of `u`; from `initial` unless given one."""
        return _run(self, self.initial() if state is None else state, as_float64(u))


@eqx.filter_jit
def _run(operator, state, u):
    return jax.lax.scan(lambda state, u: operator.step(state, u), state, u)
