"""Bounded parameters as functions of coordinates without bounds, for sampling.

A solver's algebraic forms flatten as 1/x^2 at a bound: a flat prior has tails like a Cauchy law
there, in which chains get lost. These flatten exponentially.
"""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.identification._parameter_vector import as_device
from fitting.solver._bound_transform import Bounds


class OpenCoordinates(eqx.Module):
    r"""Values as functions of coordinates, with the bounds, scales and coupling of `Bounds`.

    | bounds | bounded value at coordinate x |
    |---|---|
    | none | $s x$ |
    | low | $l + s \ln(1 + e^x)$ |
    | high | $h - s \ln(1 + e^{-x})$ |
    | both | $l + (h - l)/(1 + e^{-x})$ |
    """

    bounds: Bounds

    @classmethod
    def of(cls, bounds: Bounds) -> "OpenCoordinates":
        """On the device; call with 64-bit types on."""
        return cls(jax.tree_util.tree_map(as_device, bounds))

    def linearise(
        self, x: Float[Array, " values"]
    ) -> tuple[Float[Array, " values"], Float[Array, "values values"]]:
        """Values at `x`, and their Jacobian."""
        inside, slope = jax.jvp(self._inside, (x,), (jnp.ones_like(x),))
        return self.bounds.coupling @ inside, self.bounds.coupling * slope[None, :]

    def _inside(self, x: Float[Array, " values"]) -> Float[Array, " values"]:
        b = self.bounds
        has_low, has_high = jnp.isfinite(b.low), jnp.isfinite(b.high)
        low, high = jnp.where(has_low, b.low, 0.0), jnp.where(has_high, b.high, 0.0)
        below = low + b.scale * jax.nn.softplus(x)
        above = high - b.scale * jax.nn.softplus(-x)
        both = low + (high - low) * jax.nn.sigmoid(x)
        one = jnp.where(has_low, below, jnp.where(has_high, above, b.scale * x))
        return jnp.where(has_low & has_high, both, one)

    def coordinates(self, values: Float[np.ndarray, " values"]) -> Float[np.ndarray, " values"]:
        """Coordinates of `values`; infinite at a bound."""
        b = self.bounds
        low, high, scale = (np.asarray(x) for x in (b.low, b.high, b.scale))
        v = b.bounded(values)
        has_low, has_high = np.isfinite(low), np.isfinite(high)
        x = v / scale
        sides = (has_low & ~has_high, 1.0, v - low), (has_high & ~has_low, -1.0, high - v)
        with np.errstate(divide="ignore"):  # infinite at a bound
            for only, sign, far in sides:
                w = far[only] / scale[only]
                x[only] = sign * (w + np.log(-np.expm1(-w)))
            both = has_low & has_high
            x[both] = np.log(v[both] - low[both]) - np.log(high[both] - v[both])
        return x
