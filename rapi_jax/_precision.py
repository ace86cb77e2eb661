"""Float64 for our own work, whatever the host's flag, without touching the flag."""

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array

P = ParamSpec("P")
T = TypeVar("T")


def float64(function: Callable[P, T]) -> Callable[P, T]:
    """Run `function` with 64-bit JAX types, then leave the host's setting as it was.

    The setting is a thread-local context, so a host that keeps `jax_enable_x64` off sees no change
    before, after, or in its other threads.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return wrapped


def as_float64(value: Any) -> Array:
    """`value` as a float64 JAX array; integers and float32 are widened, nothing is narrowed."""
    with jax.enable_x64(True):
        if isinstance(value, jax.Array):
            return value.astype(jnp.float64)
        # With a type named, nothing is compiled; without, one program for each shape.
        return jnp.asarray(np.asarray(value, dtype=np.float64), dtype=jnp.float64)
