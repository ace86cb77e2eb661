r"""Plays by a prefix scan: the composition of two clamps is a clamp.

A sample maps a play's output to $\max(l, \min(h, v))$ (Eq. 9). Two such maps after one another are
again one, so all samples are composed in a number of passes that grows as the logarithm of their
number: more work than a recursion, but none of it waits for the sample before. For accelerators.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int


class _Clamps(NamedTuple):
    """The maps `v -> max(low, min(high, v))`, `low <= high`, of stretches of samples.

    What is told of a bound: the sample whose own bound it is, and whether that was the lower one.
    """

    low: Array
    high: Array
    low_contact: Array
    high_contact: Array
    low_below: Array
    high_below: Array


def _after(first: _Clamps, second: _Clamps) -> _Clamps:
    """The clamps `second` after `first`."""

    def through(value, contact, below):
        under, over = value < second.low, value > second.high
        value = jnp.where(under, second.low, jnp.where(over, second.high, value))
        contact = jnp.where(
            under, second.low_contact, jnp.where(over, second.high_contact, contact)
        )
        return (
            value,
            contact,
            jnp.where(under, second.low_below, jnp.where(over, second.high_below, below)),
        )

    low, low_contact, low_below = through(first.low, first.low_contact, first.low_below)
    high, high_contact, high_below = through(first.high, first.high_contact, first.high_below)
    return _Clamps(low, high, low_contact, high_contact, low_below, high_below)


def prefix_contacts(
    lower: Float[Array, "time *lanes"],
    upper: Float[Array, "time *lanes"],
    start: Float[Array, "*lanes"],
) -> tuple[Float[Array, "time *lanes"], Int[Array, "time *lanes"], Bool[Array, "time *lanes"]]:
    """Outputs, sample of the last contact (-1: none yet), and whether from below.

    Where the band is crossed, `lower` wins, as if it were the upper bound too.
    """
    sample = jnp.arange(lower.shape[0], dtype=jnp.int32)
    sample = jnp.broadcast_to(sample.reshape(-1, *(1,) * (lower.ndim - 1)), lower.shape)
    crossed = lower > upper
    high = jnp.where(crossed, lower, upper)
    each = _Clamps(lower, high, sample, sample, jnp.ones_like(crossed), crossed)
    all_ = jax.lax.associative_scan(_after, each)
    begun = jnp.broadcast_to(start[None], lower.shape)
    under, over = begun < all_.low, begun > all_.high
    value = jnp.where(under, all_.low, jnp.where(over, all_.high, begun))
    contact = jnp.where(under, all_.low_contact, jnp.where(over, all_.high_contact, -1))
    below = jnp.where(under, all_.low_below, over & all_.high_below)
    return value, contact, below


def _bounds_after(first: tuple[Array, Array], second: tuple[Array, Array]) -> tuple[Array, Array]:
    low, high = second
    return tuple(jnp.maximum(low, jnp.minimum(high, bound)) for bound in first)  # type: ignore[return-value]


def prefix_values(
    lower: Float[Array, "time *lanes"],
    upper: Float[Array, "time *lanes"],
    start: Float[Array, "*lanes"],
) -> Float[Array, "time *lanes"]:
    """Outputs alone."""
    each = lower, jnp.maximum(lower, upper)
    low, high = jax.lax.associative_scan(_bounds_after, each)
    return jnp.maximum(low, jnp.minimum(high, jnp.broadcast_to(start[None], lower.shape)))
