"""Bounds by a change of variables: a value is a smooth function of an unbounded coordinate.

Algebraic forms are used, not exponentials: near a bound they flatten as 1/x^2, so that a start far
away still has a gradient, and far from a bound they are linear.
"""

from typing import TYPE_CHECKING, Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from ._thresholds import THRESHOLDS

if TYPE_CHECKING:
    Numbers = Array
else:
    Numbers = Array | np.ndarray  # before they are put on a device


class Bounds(eqx.Module):
    r"""Bounds of a parameter vector, and the bijection that keeps a fit inside them.

    `low` and `high` hold for `coupling^-1 @ values`: a coupling `values = coupling @ bounded`
    (invertible, not always triangular) lets one parameter's bound move with another's. `scale` is a
    typical size of each.

    | bounds | bounded value at coordinate x |
    |---|---|
    | none | $s x$ |
    | low | $l + s (x + \sqrt{x^2 + 4}) / 2$ |
    | high | $h - s (\sqrt{x^2 + 4} - x) / 2$ |
    | both | $l + (h - l)(1 + x/\sqrt{1 + x^2})/2$ |
    """

    low: Float[Numbers, " parameters"]
    high: Float[Numbers, " parameters"]
    scale: Float[Numbers, " parameters"]
    coupling: Float[Numbers, "parameters parameters"]

    def values(self, x: Float[Array, " parameters"]) -> Float[Array, " parameters"]:
        """Physical values at unbounded coordinates `x`."""
        return self.coupling @ self._inside(x)

    def linearise(
        self, x: Float[Array, " parameters"]
    ) -> tuple[Float[Array, " parameters"], Float[Array, "parameters parameters"]]:
        """The same, and their Jacobian."""
        inside, slope = jax.jvp(self._inside, (x,), (jnp.ones_like(x),))
        return self.coupling @ inside, self.coupling * slope[None, :]

    def _inside(self, x: Float[Array, " parameters"]) -> Float[Array, " parameters"]:
        """What `low` and `high` hold for, at `x`; each by its own coordinate alone."""
        has_low, has_high = jnp.isfinite(self.low), jnp.isfinite(self.high)
        low = jnp.where(has_low, self.low, 0.0)
        high = jnp.where(has_high, self.high, 0.0)
        root = jnp.sqrt(x**2 + 4.0)
        # x + root cancels for large negative x; 4 / (root - x) is the same number
        rise = jnp.where(x > 0, x + root, 4.0 / (root - jnp.where(x > 0, 0.0, x)))
        fall = jnp.where(x < 0, root - x, 4.0 / (root + jnp.where(x < 0, 0.0, x)))
        both = low + (high - low) * (1.0 + x / jnp.sqrt(1.0 + x**2)) / 2.0
        one = jnp.where(has_low, low + self.scale * rise / 2.0, high - self.scale * fall / 2.0)
        return jnp.where(
            has_low & has_high, both, jnp.where(has_low | has_high, one, self.scale * x)
        )

    def bounded(self, values: np.ndarray) -> np.ndarray:
        """What `low` and `high` hold for: `values` with the couplings taken out."""
        coupling, values = np.asarray(self.coupling), np.asarray(values, dtype=float)
        coupled = (coupling != np.eye(values.size)).any(axis=1)
        known = values[coupled] - coupling[np.ix_(coupled, ~coupled)] @ values[~coupled]
        bounded = values.copy()  # those without a coupling stay as they are, to the last bit
        bounded[coupled] = np.linalg.solve(coupling[np.ix_(coupled, coupled)], known)
        return bounded

    def coordinates(self, values: np.ndarray) -> np.ndarray:
        """Unbounded coordinates of `values`; those outside the bounds are reflected inside."""
        low, high, scale = (np.asarray(v) for v in (self.low, self.high, self.scale))
        inside = THRESHOLDS.inside_bound
        v = self.bounded(values)
        v = np.where(v < low, low + (low - v), v)
        v = np.where(v > high, high - (v - high), v)
        both = np.isfinite(low) & np.isfinite(high)
        below = np.isfinite(low) & ~both
        above = np.isfinite(high) & ~both
        x = v / scale
        w = np.maximum((v[below] - low[below]) / scale[below], inside)
        x[below] = w - 1.0 / w
        w = np.maximum((high[above] - v[above]) / scale[above], inside)
        x[above] = 1.0 / w - w
        width = high[both] - low[both]
        y = 2.0 * (v[both] - low[both]) / width - 1.0
        least = 2.0 * inside * np.minimum(scale[both], width) / width
        y = np.clip(y, -1.0 + least, 1.0 - least)
        x[both] = y / np.sqrt(1.0 - y**2)
        return x

    def at_bound(self, values: np.ndarray) -> np.ndarray:
        """Whether each value lies on a bound, within a small share of its typical size."""
        slack = THRESHOLDS.at_bound
        v = self.bounded(values)
        low, high, scale = (np.asarray(b) for b in (self.low, self.high, self.scale))
        size = np.minimum(scale, high - low)  # bounds may lie decades beyond any value
        return (v - low < slack * size) | (high - v < slack * size)

    def holding(self, free: Bool[np.ndarray, " parameters"]) -> "Bounds":
        """The same where only the values marked `free` move.

        The others lose their bounds and scales: a value on its bound has no coordinate, and would
        be moved inside. They are their own coordinates, to the last bit.
        """
        fields: Any = (
            np.where(free, self.low, -np.inf),
            np.where(free, self.high, np.inf),
            np.where(free, self.scale, 1.0),
            np.where(free[:, None], self.coupling, np.eye(free.size)),
        )
        return Bounds(*fields)

    @classmethod
    def of(
        cls,
        start: np.ndarray,
        low: np.ndarray | None = None,
        high: np.ndarray | None = None,
        coupling: np.ndarray | None = None,
    ) -> "Bounds":
        """Bounds for a fit from `start`, with typical sizes read off it."""
        n = start.size
        low = np.full(n, -np.inf) if low is None else np.asarray(low, dtype=float)
        high = np.full(n, np.inf) if high is None else np.asarray(high, dtype=float)
        coupling = np.eye(n) if coupling is None else coupling
        v = np.linalg.solve(coupling, start)
        reach = np.abs(
            np.where(np.isfinite(low), v - low, np.where(np.isfinite(high), high - v, v))
        )
        scale = np.where(reach > THRESHOLDS.smallest_scale, reach, 1.0)
        fields: Any = (np.asarray(a, dtype=float) for a in (low, high, scale, coupling))
        return cls(*fields)
