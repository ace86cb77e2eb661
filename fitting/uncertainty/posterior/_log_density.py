r"""The log posterior density of a fit's parameters, in whitened coordinates.

Readings are normal about the model, with the covariance $T$ of the noise that was found in the
residuals, held there; priors are flat within the parameters' bounds. What is linear has a flat
prior without bounds and is integrated out, which leaves
$$-\tfrac12\,e'\left(T^{-1} - T^{-1}X(X'T^{-1}X)^{-1}X'T^{-1}\right)e$$
(G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10, 413, 1973, for the minimum; the integral has
the same shape, since $X$ depends on the drive alone). The others are smooth functions of unbounded
coordinates, $x = x_0 + Lz$, with $LL'$ their covariance at the optimum.
"""

import abc

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from fitting.identification.intervals._data import IntervalData
from fitting.identification.intervals._residual import IntervalResidual
from fitting.identification.problem._run_residual import RunResidual
from rapi_jax.internal import DriveBatch

from ._noise_precision import NoisePrecision
from ._open_coordinates import OpenCoordinates


class AbstractMisfit(eqx.Module):
    """The weighted sum of squares that is left once the linear part is at its best."""

    @abc.abstractmethod
    def __call__(self, own: Float[Array, " values"]) -> Float[Array, ""]:
        """At the vector `own`, without what is linear."""


class IntervalMisfit(AbstractMisfit):
    """Of white noise: over contact intervals, whatever the number of samples."""

    residual: IntervalResidual
    data: IntervalData

    def __call__(self, own):
        return jnp.sum(self.residual(own, self.data) ** 2)


class SampleMisfit(AbstractMisfit):
    """Of any stationary noise, over the samples.

    - `target`: readings less the linear part at the optimum. `columns`: `T^-1 X`, "runs longest
      linear". `covariance`: of the linear part, `(X'T^-1 X)^-1`. `linear`: at the optimum.
    """

    residual: RunResidual
    drives: DriveBatch
    target: Float[Array, "runs time"]
    precision: NoisePrecision
    columns: Float[Array, "runs longest linear"]
    covariance: Float[Array, "linear linear"]
    linear: Float[Array, " linear"]

    def __call__(self, own):
        error = self._error(own)
        taken = self._overlap(error)
        return self.precision.square(error) - taken @ (self.covariance @ taken)

    def best_linear(self, own: Float[Array, " values"]) -> Float[Array, " linear"]:
        """The linear part about which it is normal, given the others."""
        return self.linear - self.covariance @ self._overlap(self._error(own))

    def _error(self, own: Array) -> Float[Array, "runs time"]:
        return self.residual.model(own, self.drives) - self.target

    def _overlap(self, error: Array) -> Float[Array, " linear"]:
        return jnp.einsum("rt,rtq->q", self.precision.cut(error), self.columns)


class LogDensity(eqx.Module):
    """The log posterior density at whitened coordinates `z`, up to a constant.

    - `own`: the vector at the optimum. `moves`: places in it of what moves.
    - `middle`, `spread`: `x_0` and `L` of what moves.
    """

    misfit: AbstractMisfit
    coordinates: OpenCoordinates
    own: Float[Array, " values"]
    moves: Int[Array, " moved"]
    middle: Float[Array, " values"]
    spread: Float[Array, "moved moved"]

    def __call__(self, z: Float[Array, " moved"]) -> Float[Array, ""]:
        own, slope = self._linearised(z)
        return -0.5 * self.misfit(own) + jnp.sum(jnp.log(slope[self.moves]))

    def vector(self, z: Float[Array, " moved"]) -> Float[Array, " values"]:
        """The vector of values at `z`."""
        return self._linearised(z)[0]

    def _linearised(self, z: Array) -> tuple[Float[Array, " values"], Float[Array, " values"]]:
        """Values and the derivative of each by its own coordinate; couplings have determinant 1."""
        x = self.middle.at[self.moves].add(self.spread @ z)
        values, jacobian = self.coordinates.linearise(x)
        # What does not move is as it was, to the last bit.
        moved = jnp.zeros(self.own.size, dtype=bool).at[self.moves].set(True)
        return jnp.where(moved, values, self.own), jnp.diagonal(jacobian)
