"""The classical Prandtl-Ishlinskii operator."""

from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._errors import ModelError
from rapi_jax._parameter import parameter
from rapi_jax._precision import float64
from rapi_jax.plays._plays import Plays

from ._base import AbstractOperator, Fields, check_polynomial


class PI(AbstractOperator):
    r"""The classical operator: $\sum_i p_i\,\Gamma_{r_i}[u] + d_0 + \sum_k d_k u^k$ (Eqs. 8, 14).

    | field | meaning | unit |
    |---|---|---|
    | `r` | thresholds, one per play, the same at every rate and amplitude | V |
    | `p` | weights, one per play | GHz/V |
    | `d` | polynomial; `d_1` is the `p_0` of Eq. 17 | GHz/V^k |
    | `d_0` | origin of the response | GHz |
    | `origin` | the drive from which plays and polynomial count; held in fits | V |

    Symmetric and rate-independent: the yardstick beside `RAPI`, and the operator whose inverse has
    a closed form (Eq. 17).

    >>> import jax.numpy as jnp
    >>> from rapi_jax import PI
    >>> operator = PI(r=[0.5], p=[2.0], d=[1.0])  # one play of 0.5 V and a straight line
    >>> operator(jnp.array([0.0, 1.0, 2.0, 1.5, 1.0]), jnp.array(10.0)).tolist()
    [1.0, 2.0, 5.0, 4.5, 4.0]
    """

    r: Float[Array, " plays"] = parameter(unit="{u}", positive=True)
    p: Float[Array, " plays"] = parameter(unit="{x}/{u}")
    d: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    d_0: Float[Array, ""] = parameter(unit="{x}", linear=True)
    origin: Float[Array, ""] = parameter(unit="{u}", default=0.0, held=True)
    fields: ClassVar = Fields("d", "d_0", "origin")
    weight: ClassVar = "p"

    def __init__(self, *, r: Any, p: Any, d: Any, d_0: Any = 0.0, origin: Any = 0.0):
        self.r, self.p, self.d, self.d_0, self.origin = r, p, d, d_0, origin

    def __check_init__(self):
        if jnp.ndim(self.r) != 1 or jnp.shape(self.r) != jnp.shape(self.p):
            raise ValueError(
                "Arguments `r` and `p` must hold one threshold and one weight a play, but have "
                f"shapes {jnp.shape(self.r)} and {jnp.shape(self.p)}."
            )
        check_polynomial(self)

    @property
    def count(self) -> int:
        return self.r.size

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        del u_pp, freq
        one = jnp.ones_like(self.r)
        return Plays(self.r, one, one, self.p)

    @float64
    def inverse(self) -> "PI":
        """The operator that gives back the drive from the response: again a PI, in closed form.

        Its thresholds are in the response's unit, its `d` and `p` in drive over response units. Its
        plays start as Eq. 13 has them at the least response, which is where those of this operator
        stand at the least drive. Raises `ModelError` where there is none: with a polynomial of
        order two or more (other than zero), or where the slope of some part of a branch,
        `p_0 + ... + p_i`, is not positive.
        """
        r, p, d = (np.asarray(v, dtype=float) for v in (self.r, self.p, self.d))
        if d[1:].any():
            raise ModelError(
                f"a PI whose polynomial goes to order {np.flatnonzero(d)[-1] + 1} has no inverse "
                "in closed form. Fit it with one coefficient in `d`, or invert it sample by sample "
                "(`exact_inverse`)."
            )
        order = np.argsort(r, kind="stable")
        slope = np.cumsum(np.concatenate([d[:1], p[order]]))  # p_0 + ... + p_i
        bad = np.flatnonzero(~(slope > 0))
        if bad.size:
            play = f" + p of play {order[bad[0] - 1] + 1} and all narrower" if bad[0] else ""
            raise ModelError(
                f"the operator has no inverse: its slope d_1{play} is {slope[bad[0]]:.4g}, but "
                "must be positive, since otherwise two drives have one response. Use fewer plays "
                "or positive weights, or more data for the fit."
            )
        z = np.cumsum(slope[:-1] * np.diff(r[order], prepend=0.0))  # Eq. (17)
        q = np.diff(1.0 / slope)  # Eq. (17)
        # Plays of `y - d_0` are plays of `y` less `d_0`, so the offset can be taken out at the end.
        return PI(r=z, p=q, d=1.0 / slope[:1], d_0=self.origin - self.d_0 / slope[-1])
