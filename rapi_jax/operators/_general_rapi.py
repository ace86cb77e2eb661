"""The RA-PI operator with more freedom: bent bounds, growth and decay that differ among plays."""

from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax.plays._plays import Plays

from ._base import AbstractOperator, Fields, check_shapes
from ._rapi import RAPI, spread


class GeneralRAPI(AbstractOperator):
    r"""RA-PI with a bent falling bound, thresholds that grow apart, and weights of two decays.

    Everything is as in `RAPI`, but for

    | field | meaning | unit |
    |---|---|---|
    | `zeta` | growth of the thresholds with scan rate, $\zeta_i = \zeta_0 + \zeta_1 (i/N_1 - 1/2)$ | V/Hz |
    | `b` | decay of the weights, $p_i = a_i \exp(-b_1 r_i - b_2 r_i^2)$ | 1/V, 1/V^2 |
    | `bow` | bend of all falling bounds: $\lambda_i u + \eta_i r_i + c (u - u_0)^2$ | 1/V |
    | `u_0` | the drive about which they bend; held in fits, since `lam` and `eta` follow it | V |

    With `bow` and the second entries of `zeta` and `b` at 0 it is `RAPI` (see `of`). It inverts
    where all falling bounds rise, $\lambda_i + 2 c (u - u_0) > 0$, and the rest outweighs what
    plays of negative weight take away: see `certify`. Nonlinear bounds make
    the generalised Prandtl-Ishlinskii operator (Al Janaideh, Rakheja and Su, 2009); the other two
    let a device whose weights fall by another law than Eq. 14 be told from one with an effect that
    no hysteresis has.
    """  # noqa: E501

    alpha: Float[Array, "*plays"] = parameter(unit="1", positive=True)
    zeta: Float[Array, " two"] = parameter(unit="{u}/Hz")
    lam: Float[Array, "*plays"] = parameter(unit="1", bounds=(0.05, 20.0))
    eta: Float[Array, "*plays"] = parameter(unit="1", bounds=(-1.0, 100.0))
    a: Float[Array, "*plays"] = parameter(unit="{x}/{u}")
    b: Float[Array, " two"] = parameter(unit="1/{u}^k")
    bow: Float[Array, ""] = parameter(unit="1/{u}")
    u_0: Float[Array, ""] = parameter(unit="{u}", held=True)
    d: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    d_0: Float[Array, ""] = parameter(unit="{x}", linear=True)
    count: int = eqx.field(static=True, kw_only=True)
    fields: ClassVar = Fields("d", "d_0")

    def __init__(
        self,
        *,
        alpha: Any,
        zeta: Any,
        lam: Any,
        eta: Any,
        a: Any,
        b: Any,
        d: Any,
        d_0: Any = 0.0,
        bow: Any = 0.0,
        u_0: Any = 0.0,
        plays: int = 10,
    ):
        """`plays` is N1, the size of `d` N2. `alpha`, `lam`, `eta`, `a`: one number or `plays`.

        `zeta` and `b`: two numbers.
        """
        self.alpha, self.zeta, self.lam, self.eta = alpha, zeta, lam, eta
        self.a, self.b, self.bow, self.u_0 = a, b, bow, u_0
        self.d, self.d_0, self.count = d, d_0, plays

    def __check_init__(self):
        check_shapes(self, ("alpha", "lam", "eta", "a"), ("bow", "u_0", "d_0"))
        for name in ("zeta", "b"):
            if jnp.shape(getattr(self, name)) != (2,):
                raise ValueError(
                    f"Argument `{name}` must be two numbers, but has shape "
                    f"{jnp.shape(getattr(self, name))}."
                )

    @classmethod
    def of(cls, operator: RAPI, *, u_0: Any = 0.0) -> "GeneralRAPI":
        """The same function of the drive as `operator`, free to bend about `u_0`."""
        same = {name: getattr(operator, name) for name in ("alpha", "lam", "eta", "a", "d", "d_0")}
        zeta, b = (jnp.stack([x, jnp.zeros_like(x)]) for x in (operator.zeta, operator.b))
        return cls(**same, zeta=zeta, b=b, u_0=u_0, plays=operator.count)

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        rank = jnp.arange(1.0, self.count + 1.0) / self.count
        growth = self.zeta[0] + self.zeta[1] * (rank - 0.5)
        r = spread(self.alpha, self.count) * rank * u_pp / 2.0 + growth * freq  # Eq. (11)
        p = spread(self.a, self.count) * jnp.exp(-self.b[0] * r - self.b[1] * r**2)
        shape = (spread(self.lam, self.count), spread(self.eta, self.count))
        return Plays(r, *shape, p, self.bow, self.u_0)

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        del u_pp, freq
        return {}
