"""The response's derivative behind effects that are neither linear nor before the operator.

Most of these change each sample by itself, so that one derivative by the response is a factor for
every column: nothing is compiled for a number of columns, which differs from base to base.
"""

from collections.abc import Sequence

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from fitting.diagnosis.refit._thresholds import THRESHOLDS
from rapi_jax.effects import AbstractEffect
from rapi_jax.internal import DriveBatch, optical_side

from ._operator_jacobian import Linearised


def linearise_optical_effects(
    effects: Sequence[AbstractEffect], drives: DriveBatch, operator: Linearised
) -> Float[np.ndarray, "values runs time"]:
    """The derivative of the response behind `effects` by each value of the operator."""
    nu, columns = operator
    for effect in effects:
        if effect.pointwise:
            nu, factor = _factor(effect, drives, nu)
            columns = columns * np.asarray(factor)
        else:
            more = -len(columns) % THRESHOLDS.columns_bucket
            padded = np.pad(columns, [(0, more), (0, 0), (0, 0)])
            nu, changed = _push_columns(effect, drives, nu, padded)
            columns = np.asarray(changed)[: len(columns)]
    return columns


@jax.jit
def _factor(
    effect: AbstractEffect, drives: DriveBatch, nu: Float[Array, "runs time"]
) -> tuple[Float[Array, "runs time"], Float[Array, "runs time"]]:
    """The response behind a pointwise effect, and its derivative by the response there."""
    return jax.jvp(lambda nu: optical_side((effect,), drives, nu), (nu,), (jnp.ones_like(nu),))


@jax.jit
def _push_columns(
    effect: AbstractEffect,
    drives: DriveBatch,
    nu: Float[Array, "runs time"],
    columns: Float[Array, "values runs time"],
) -> tuple[Float[Array, "runs time"], Float[Array, "values runs time"]]:
    """The response behind an effect, and the derivatives `columns` of the response there."""
    nu, push = jax.linearize(lambda nu: optical_side((effect,), drives, nu), nu)
    return nu, jax.vmap(push)(columns)
