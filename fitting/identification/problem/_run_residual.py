"""Residuals of all runs, sample by sample (Eq. 25)."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from fitting.identification._parameter_vector import ParameterVector
from rapi_jax import ECDL
from rapi_jax.internal import DriveBatch, respond


class Data(eqx.Module):
    """What a residual needs besides the parameters, as arrays."""

    drives: DriveBatch
    y: Float[Array, "runs time"]
    weight: Float[Array, "runs time"]  # square root of the weight, 0 where a sample is not used
    basis: Float[Array, "samples linear"]  # orthonormal columns, projected out


class RunResidual(eqx.Module):
    """Weighted model less data over all runs, flattened; `values`: the model's, then `initial`."""

    ecdl: ECDL
    vector: ParameterVector = eqx.field(static=True)
    unknown: tuple[int, ...] = eqx.field(static=True)  # runs whose initial fractions end `values`

    def model(self, values: Array, drives: DriveBatch) -> Float[Array, "runs time"]:
        """The model's response in every run."""
        ecdl = self.vector.put(self.ecdl, values)
        initial = None
        if self.unknown:
            rest = values[self.vector.size :].reshape(len(self.unknown), -1)
            known = jnp.full((drives.time.shape[0], rest.shape[1]), jnp.nan)
            initial = known.at[jnp.array(self.unknown)].set(rest)

        return respond(ecdl, drives, initial)

    def __call__(self, values: Array, data: Data) -> Array:
        error = data.weight * (self.model(values, data.drives) - data.y)  # Eq. (25)
        flat = error.ravel()
        return flat - data.basis @ (data.basis.T @ flat)
