"""How the thresholds of an operator follow the swing, in words."""

import jax.numpy as jnp
import numpy as np

from rapi_jax import AbstractOperator
from rapi_jax.internal import float64

from ._thresholds import THRESHOLDS


@float64
def threshold_law(operator: AbstractOperator, u_pp: float, unit: str) -> str:
    """What the thresholds do as the peak-to-peak drive grows from `u_pp`, at rate 0.

    `unit`: of the drive. For an operator without thresholds: that it has none.
    """
    small, large = (
        float(np.sum(np.asarray(operator.plays(jnp.asarray(k * u_pp), jnp.asarray(0.0)).r)))
        for k in (1.0, 2.0)
    )
    if small <= 0.0:
        return "no thresholds"
    exponent = float(np.log2(large / small)) if large > 0.0 else -np.inf
    if abs(exponent) < THRESHOLDS.equal_law:
        return f"thresholds fixed in {unit}"
    if abs(exponent - 1.0) < THRESHOLDS.equal_law:
        return "thresholds that grow with the swing"
    return f"thresholds that grow {'slower' if exponent < 1.0 else 'faster'} than the swing"
