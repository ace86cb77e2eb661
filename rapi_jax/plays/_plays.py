"""The play operators of one run: their bounds (Eqs. 9, 12) and their first outputs (Eq. 13)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float


class Plays(eqx.Module):
    """The play operators of one run: thresholds, shapes and weights, each of shape `plays`.

    `bow` and `u_0` bend all falling bounds alike, by `bow (u - u_0)^2`; `None`: they are straight.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.examples import paper_device
    >>> plays = paper_device().operator.plays(jnp.array(4.5), jnp.array(10.0))
    >>> plays.r.shape, round(float(plays.r[0]), 4)  # V
    ((10,), 0.1304)
    """

    r: Float[Array, " plays"]
    lam: Float[Array, " plays"]
    eta: Float[Array, " plays"]
    p: Float[Array, " plays"]
    bow: Float[Array, ""] | None = None
    u_0: Float[Array, ""] | None = None

    def upper(self, u: Float[Array, ""]) -> Float[Array, " plays"]:
        """The falling bounds at the drive `u`."""
        straight = self.lam * u + self.eta * self.r  # Eq. (12)
        if self.bow is None or self.u_0 is None:
            return straight
        return straight + self.bow * (u - self.u_0) ** 2

    def falling(self, u: Float[Array, ""]) -> Float[Array, " plays"]:
        """The slopes of the falling bounds at the drive `u`."""
        if self.bow is None or self.u_0 is None:
            return self.lam
        return self.lam + 2.0 * self.bow * (u - self.u_0)

    def clamped(
        self, u: Float[Array, ""], before: Float[Array, " plays"]
    ) -> Float[Array, " plays"]:
        """The outputs at the drive `u`, after `before` (Eq. 9)."""
        return jnp.maximum(u - self.r, jnp.minimum(self.upper(u), before))

    def lowest(self, u_min: Float[Array, ""]) -> Float[Array, " plays"]:
        """The outputs at the minimum of a periodic drive (Eq. 13)."""
        return jnp.maximum(u_min - self.r, self.upper(u_min))

    def start(
        self,
        u: Float[Array, " time"],
        u_min: Float[Array, ""],
        initial: Float[Array, " plays"] | None,
    ) -> Float[Array, " plays"]:
        """Outputs before the first sample: Eq. 13, or the fraction `initial` of each first band.

        A NaN in `initial` stands for Eq. 13.
        """
        start = self.lowest(u_min)
        if initial is None:
            return start
        low = u[0] - self.r
        high = self.lowest(u[0])
        given = ~jnp.isnan(initial)
        return jnp.where(given, low + jnp.where(given, initial, 0.0) * (high - low), start)
