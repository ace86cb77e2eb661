"""The device: an operator with effects around it, and what it answers to a drive."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from ._precision import float64
from ._recording import Drive
from .effects import AbstractDriveEffect, AbstractEffect, AbstractOpticalEffect
from .operators import AbstractOperator


class ECDL(eqx.Module):
    """An external-cavity diode laser, or any device a hysteresis operator describes.

    Drive effects act in order before the operator, optical effects in order after it.
    """

    operator: AbstractOperator
    effects: tuple[AbstractEffect, ...] = ()

    def __call__(
        self,
        t: Float[Array, " time"],
        u: Float[Array, " time"],
        freq: Float[Array, ""],
        *,
        initial: Float[Array, " plays"] | None = None,
        u_pp: Float[Array, ""] | None = None,
        u_min: Float[Array, ""] | None = None,
    ) -> Float[Array, " time"]:
        """The response to `u` at session times `t` (s), scan rate `freq` (Hz); see the operator.

        `u_pp` is that of the drive sent, whatever effects make of it: thresholds follow the run
        (Eq. 11). Eq. 13 looks at the drive that reaches the operator.
        """
        u_pp = jnp.ptp(u) if u_pp is None else u_pp
        for effect in self.effects:
            if isinstance(effect, AbstractDriveEffect):
                u, u_min = effect(t, u), None
        response = self.operator(u, freq, initial=initial, u_pp=u_pp, u_min=u_min)
        for effect in self.effects:
            if isinstance(effect, AbstractOpticalEffect):
                response = effect(t, response)
        return response


@eqx.filter_jit
def _respond(ecdl, t, u, freq, initial, u_pp, u_min):
    return ecdl(t, u, freq, initial=initial, u_pp=u_pp, u_min=u_min)


@float64
def predict(ecdl: ECDL, drive: Drive, *, initial: Any = None) -> Float[Array, " time"]:
    """The response of `ecdl` to `drive`, at each of its samples, in the response's unit.

    A drive that repeats is preceded by a settling period, so that the answer is the steady one. For
    others `initial` may give each play's first output as a fraction of its band (0 lower, 1 upper);
    without it the plays start as Eq. 13 has them at the drive's minimum.
    """
    lead = drive.lead_in()
    u = np.concatenate([lead, drive.value])
    t = drive.start_s + np.arange(-lead.size, drive.size) * drive.step_s
    given = None if initial is None else jnp.asarray(initial, dtype=jnp.float64)
    numbers = [jnp.asarray(v) for v in (drive.rate, drive.u_pp, float(drive.value.min()))]
    freq, u_pp, u_min = numbers
    return _respond(ecdl, jnp.asarray(t), jnp.asarray(u), freq, given, u_pp, u_min)[lead.size :]
