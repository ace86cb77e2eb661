"""An operator at one scan rate and amplitude: plain numbers, evaluated one sample at a time."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._ecdl import ECDL
from rapi_jax._precision import as_float64, float64
from rapi_jax.operators import AbstractOperator
from rapi_jax.plays._contact_intervals import Band

from .._root import Scalar
from ._thresholds import THRESHOLDS


class FrozenOperator(eqx.Module):
    r"""The plays and the polynomial of one run, in the drive `x = u - origin`.

    - `r`: thresholds (Eq. 11). `p`: weights (Eq. 14).
    - `lam`, `offset`, `bow`: the falling bounds $U_i(x) = (\lambda_i + c x) x + o_i$ (Eq. 12), the
      bend $c$ mostly 0.
    - `d`: the polynomial, its constant first (Eq. 15).
    - `origin`: the drive from which plays and polynomial count.
    """

    r: Float[Array, " plays"]
    p: Float[Array, " plays"]
    lam: Float[Array, " plays"]
    offset: Float[Array, " plays"]
    bow: Float[Array, ""]
    d: Float[Array, " terms"]
    origin: Float[Array, ""]

    @classmethod
    @float64
    def of(cls, model: ECDL | AbstractOperator, freq: Any, u_pp: Any) -> "FrozenOperator":
        """`model` at scan rate `freq` (Hz) and peak-to-peak drive `u_pp`.

        Raises `ValueError` where effects stand around the operator: they act on a whole period.
        """
        operator = operator_of(model)
        band = Band.of(operator.plays(as_float64(u_pp), as_float64(freq)))
        constant = float(getattr(operator, operator.fields.constant))
        numbers = (
            band.r,
            band.p,
            band.lam - 2.0 * band.bow * band.u_0,
            band.eta * band.r + band.bow * band.u_0**2,
            band.bow,
            [constant, *np.asarray(operator.coefficients)],
            -float(operator.centred(as_float64(0.0))),
        )
        return cls(*(as_float64(x) for x in numbers))

    def rest(self, u_min: Scalar) -> Float[Array, " plays"]:
        """The plays' outputs at the minimum of a run (Eq. 13)."""
        x = u_min - self.origin
        return jnp.maximum(x - self.r, self._upper(x))

    def clamped(self, u: Scalar, before: Float[Array, " plays"]) -> Float[Array, " plays"]:
        """The plays' outputs at the drive `u`, after `before` (Eq. 9)."""
        x = u - self.origin
        return jnp.maximum(x - self.r, jnp.minimum(self._upper(x), before))

    def respond(self, u: Scalar, before: Float[Array, " plays"]) -> tuple[Scalar, Scalar]:
        """Response to `u` after `before` (Eq. 16), and its slope in `u`, one side's at a kink.

        Play by play in scalars: the compiler makes one kernel of all steps on a sample, while a sum
        over an array is a kernel of its own, and takes longer to start than to run.
        """
        x = u - self.origin
        value, slope = self.d[-1], jnp.zeros_like(x)
        for k in range(self.d.shape[0] - 2, -1, -1):
            slope = slope * x + value
            value = value * x + self.d[k]  # Eq. (15)
        bend = self.bow * x
        for i in range(self.r.shape[0]):
            lower, upper = x - self.r[i], (self.lam[i] + bend) * x + self.offset[i]  # Eq. (12)
            capped = jnp.minimum(upper, before[i])
            value += self.p[i] * jnp.maximum(lower, capped)  # Eqs. (9), (14)
            falls = jnp.where(upper <= before[i], self.lam[i] + 2.0 * bend, 0.0)
            slope += self.p[i] * jnp.where(lower >= capped, 1.0, falls)
        return value, slope

    def _upper(self, x: Scalar) -> Float[Array, " plays"]:
        return (self.lam + self.bow * x) * x + self.offset


def operator_of(model: ECDL | AbstractOperator) -> AbstractOperator:
    """The operator of `model`; `ValueError` where effects stand around it."""
    if isinstance(model, AbstractOperator):
        return model
    if model.effects:
        named = ", ".join(type(effect).__name__ for effect in model.effects)
        raise ValueError(
            f"Argument `model` must have no effects around its operator, but has {named}: a "
            "streaming step sees one sample. `compensate` undoes effects over a whole period; or "
            "give the operator alone."
        )
    return model.operator


def response_rounding(frozen: FrozenOperator, low: float, high: float) -> float:
    """A response to drives within `low` and `high` is known to this, response unit."""
    x = max(abs(low - float(frozen.origin)), abs(high - float(frozen.origin)))
    r, p, offset, lam = (np.abs(a) for a in (frozen.r, frozen.p, frozen.offset, frozen.lam))
    reach = np.maximum(x + r, (lam + abs(float(frozen.bow)) * x) * x + offset)
    terms = [*(p * reach), *(np.abs(frozen.d) * x ** np.arange(frozen.d.size))]
    return float(THRESHOLDS.rounding * len(terms) * np.finfo(float).eps * np.sum(terms))
