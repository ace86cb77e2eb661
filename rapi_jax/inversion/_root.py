"""One scalar root of an increasing function: Newton's steps, kept inside a bracket by bisection."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from ._thresholds import THRESHOLDS

Scalar = Float[Array, ""]


def search(
    f: Callable[[Scalar, Any], Scalar], args: Any, low: Scalar, high: Scalar, guess: Scalar
) -> Scalar:
    """The `x` of `[low, high]` where `f(x, args)`, increasing in `x`, is zero; no derivative.

    Where `f` does not change sign on the bracket, the nearer end. `f` may have kinks.
    """
    args, low, high, guess = jax.lax.stop_gradient((args, low, high, guess))
    near = 2e-16 * (jnp.abs(low) + jnp.abs(high))

    def go_on(state):
        _, below, above, step, count = state
        return (jnp.abs(step) > near) & (above - below > near) & (count < THRESHOLDS.root_steps)

    def advance(state):
        x, below, above, _, count = state
        value, rate = jax.jvp(lambda x: f(x, args), (x,), (jnp.ones_like(x),))
        below, above = jnp.where(value <= 0, x, below), jnp.where(value >= 0, x, above)
        newton = x - value / rate
        inside = (newton > below) & (newton < above)  # false for NaN too
        new = jnp.where(value == 0, x, jnp.where(inside, newton, (below + above) / 2))
        return new, below, above, new - x, count + 1

    begin = (jnp.clip(guess, low, high), low, high, high - low, 0)
    return jax.lax.stop_gradient(jax.lax.while_loop(go_on, advance, begin)[0])


def attach(f: Callable[[Scalar, Any], Scalar], args: Any, x: Scalar) -> Scalar:
    """The root `x` of `f(., args)` with its derivative in `args`, in both modes.

    The implicit function theorem as one last Newton step: it moves the value by rounding only, and
    carries the derivative that the search was cut out of.
    """
    fixed = jax.lax.stop_gradient(args)
    rate = jax.jvp(lambda x: f(x, fixed), (x,), (jnp.ones_like(x),))[1]
    rate = jax.lax.stop_gradient(rate)
    return x - f(x, args) / jnp.where(rate == 0, 1.0, rate)


def root(
    f: Callable[[Scalar, Any], Scalar], args: Any, low: Scalar, high: Scalar, guess: Scalar
) -> Scalar:
    """`search`, then `attach`, kept in the bracket. All float64; call with 64-bit types on."""
    return jnp.clip(attach(f, args, search(f, args, low, high, guess)), low, high)
