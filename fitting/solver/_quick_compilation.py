"""Compiled programs that are made soon rather than run at the last per cent of speed.

A fit's programs are many small operations on short arrays. XLA's older emitter of fused loops for
CPUs compiles them in two thirds of the time, and they run as fast.
"""

import functools
from collections.abc import Callable
from typing import Any

import equinox as eqx
import jax

_OPTIONS = {"xla_cpu_use_fusion_emitters": False}


@functools.cache
def quick_options() -> dict[str, Any]:
    """Options of XLA's compiler that save time, where it knows them; else none."""
    if jax.default_backend() != "cpu":
        return {}
    try:
        jax.jit(lambda: 0, compiler_options=_OPTIONS).lower().compile()
    except Exception:  # of a version that has another emitter
        return {}
    return _OPTIONS


def quick_jit(function: Callable[..., Any]) -> Callable[..., Any]:
    """`equinox.filter_jit` with `quick_options`, which are asked for at the first call."""

    @functools.cache
    def compiled() -> Callable[..., Any]:
        options: dict[str, Any] = {"compiler_options": quick_options()}
        return eqx.filter_jit(function, **options)

    @functools.wraps(function)
    def call(*args: Any) -> Any:
        return compiled()(*args)

    return call
