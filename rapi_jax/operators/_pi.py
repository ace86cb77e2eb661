"""The classical Prandtl-Ishlinskii operator."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from .._parameter import parameter
from ._base import AbstractOperator, Plays


class PI(AbstractOperator):
    r"""The classical operator: $\sum_i p_i\,\Gamma_{r_i}[u] + d_0 + \sum_k d_k u^k$ (Eqs. 8, 14).

    | field | meaning | unit |
    |---|---|---|
    | `r` | thresholds, one a play, the same at every rate and amplitude | V |
    | `p` | weights, one a play | GHz/V |
    | `d` | polynomial; `d_1` is the `p_0` of Eq. 17 | GHz/V^k |
    | `d_0` | origin of the response | GHz |

    Symmetric and rate-independent: the yardstick beside `RAPI`, and the operator whose inverse has
    a closed form (Eq. 17).
    """

    r: Float[Array, " plays"] = parameter(unit="{u}", positive=True)
    p: Float[Array, " plays"] = parameter(unit="{x}/{u}")
    d: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    d_0: Float[Array, ""] = parameter(unit="{x}", linear=True)

    def __init__(self, *, r: Any, p: Any, d: Any, d_0: Any = 0.0):
        self.r, self.p, self.d, self.d_0 = r, p, d, d_0

    def __check_init__(self):
        if jnp.ndim(self.r) != 1 or jnp.shape(self.r) != jnp.shape(self.p):
            raise ValueError(
                "Arguments `r` and `p` must hold one threshold and one weight a play, but have "
                f"shapes {jnp.shape(self.r)} and {jnp.shape(self.p)}."
            )
        if jnp.ndim(self.d) != 1 or jnp.size(self.d) < 1:
            raise ValueError(
                "Argument `d` must list the polynomial's coefficients from the first power on, but "
                f"has shape {jnp.shape(self.d)}."
            )

    @property
    def count(self) -> int:
        return self.r.size

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        del u_pp, freq
        one = jnp.ones_like(self.r)
        return Plays(self.r, one, one, self.p)

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        del u_pp, freq
        return {}
