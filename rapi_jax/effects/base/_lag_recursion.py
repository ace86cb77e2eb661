"""The recursion of first-order lags of a piecewise linear signal, exact for any sampling."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Inexact, Int

from rapi_jax.effects._thresholds import THRESHOLDS


def decay(elapsed_s: Array, rate: Array) -> Array:
    """The decay of each mode over `elapsed_s`."""
    return jnp.exp(-time_constants(elapsed_s, rate))


def time_constants(elapsed_s: Array, rate: Array) -> Array:
    """`elapsed_s`, whose last axis has one element, in time constants of each mode."""
    return elapsed_s.astype(rate.dtype) * rate.reshape((1,) * (elapsed_s.ndim - 1) + (-1,))


def rates(tau: Inexact[Array, " modes"]) -> tuple[Array, Array]:
    """One over each time constant, in 1/s, and which modes have none; their rate reads 0."""
    none = jnp.abs(tau) < THRESHOLDS.least_time_constant
    return jnp.where(none, 0.0, 1.0 / jnp.where(none, 1.0, tau)), none


def lag_recursion(
    t: Float[Array, "time runs"],
    x: Float[Array, "time runs"],
    rate: Inexact[Array, " modes"],
    weight: Inexact[Array, " modes"],
    samples: Int[Array, "places runs"],
) -> tuple[Float[Array, "time runs"], Inexact[Array, "places runs modes"]]:
    """The weighted sum of the lags of `x`, from 0 at the first sample, and each at `samples`.

    Time comes first, so that a step of the recursion reads and writes memory in one piece. To keep
    every lag of every sample would take longer than to compute them.
    """

    def advance(state, move):
        lag, kept, sample = state
        lag = _advance(lag, move, rate)
        kept = jnp.where((sample == samples)[:, :, None], lag[None], kept)
        return (lag, kept, sample + 1), weighted(lag, weight)

    zero = jnp.zeros((t.shape[1], rate.size), dtype=rate.dtype)
    kept = jnp.zeros((samples.shape[0], *zero.shape), dtype=zero.dtype)
    (_, kept, _), total = jax.lax.scan(advance, (zero, kept, 0), _moves(t, x))
    return total, kept


def _advance(
    lag: Inexact[Array, "runs modes"],
    move: tuple[Float[Array, " runs"], Float[Array, " runs"], Float[Array, " runs"]],
    rate: Inexact[Array, " modes"],
) -> Inexact[Array, "runs modes"]:
    """The lag of `x` by each mode one sample later; `move`: see `_moves`.

    Exact for a straight `x`, and in increments, so that a lag keeps its digits over steps that are
    short beside its time constant.
    """
    seconds, x, rise = (one[:, None] for one in move)
    h = time_constants(seconds, rate)
    lost, still = -jnp.expm1(-h), h == 0
    mean = jnp.where(still, 1.0, lost / jnp.where(still, 1.0, h))
    x, rise = x.astype(rate.dtype), rise.astype(rate.dtype)
    return lag + (lost * (x - lag) + (1.0 - mean) * rise)


def _moves(t: Array, x: Array) -> tuple[Array, Array, Array]:
    """To each sample: how far time moves, `x` before, and how far it moves; 0 to the first."""
    before = jnp.concatenate([x[:1], x[:-1]])
    return jnp.diff(t, axis=0, prepend=t[:1]), before, x - before


def weighted(
    lags: Inexact[Array, "*more modes"], weight: Inexact[Array, " modes"]
) -> Float[Array, "*more"]:
    """The real part of the weighted sum over modes."""
    return jnp.real((lags * weight.reshape((1,) * (lags.ndim - 1) + (-1,))).sum(axis=-1))
