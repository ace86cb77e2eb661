"""The RA-PI operator with more freedom: bent bounds, growth and decay that differ among plays."""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import as_float64, float64
from rapi_jax.plays._plays import Plays
from rapi_jax.recording._recording import Recording

from ._abstract_rapi import held_thresholds, one_kind_of_scan
from ._base import AbstractOperator, Fields, check_shapes, per_play
from ._guess import guess_shapes, middle_drive
from ._origin import drive_origin


class GeneralRAPI(AbstractOperator):
    r"""RA-PI with a bent falling bound, thresholds that grow apart, and weights of two decays.

    Everything is as in `RAPI`, but for

    | field | meaning | unit |
    |---|---|---|
    | `zeta` | growth of the thresholds with scan rate, $\zeta_i = \zeta_0 + \zeta_1 (i/N_1 - 1/2)$ | V/Hz |
    | `b` | decay of the weights, $p_i = a_i \exp(-b_1 r_i - b_2 r_i^2)$ | 1/V, 1/V^2 |
    | `bow` | bend of all falling bounds: $\lambda_i u + \eta_i r_i + c (u - u_0)^2$ | 1/V |
    | `rho` | what thresholds have besides, fixed in the drive's unit: $(\alpha_i u_{pp}/2 + \rho_i)\,i/N_1$; shared or one per play; held in fits | V |
    | `u_0` | the drive, from the origin, about which they bend; held in fits, since `lam` and `eta` follow it | V |

    With `bow` and the second entries of `zeta` and `b` at 0 it is `MixedRAPI`, without `rho` `RAPI`
    (see `of`). It inverts
    where all falling bounds rise, $\lambda_i + 2 c (u - u_0) > 0$, and the rest outweighs what
    plays of negative weight take away: see `certify`. Nonlinear bounds make
    the generalised Prandtl-Ishlinskii operator (Al Janaideh, Rakheja and Su, 2009); the other two
    let a device whose weights fall by another law than Eq. 14 be told from one with an effect that
    no hysteresis has.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import GeneralRAPI
    >>> operator = GeneralRAPI(
    ...     alpha=0.25, zeta=[0.0, 0.0], lam=1.0, eta=1.0, a=0.6, b=[0.1, 0.0], d=[18.8], plays=2
    ... )
    >>> operator.plays(jnp.array(4.0), jnp.array(10.0)).r.round(3).tolist()  # V
    [0.25, 0.5]
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
    origin: Float[Array, ""] = parameter(unit="{u}", default=0.0, held=True)
    rho: Float[Array, "*plays"] = parameter(unit="{u}", default=0.0, positive=True, held=True)
    count: int = eqx.field(static=True, kw_only=True)
    fields: ClassVar = Fields("d", "d_0", "origin")
    weight: ClassVar = "a"
    tied_first: ClassVar = ("alpha", "lam", "eta")

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
        origin: Any = 0.0,
        rho: Any = 0.0,
        plays: int = 10,
    ):
        """`plays` is N1, the size of `d` N2.

        `alpha`, `rho`, `lam`, `eta`, `a`: one number or `plays`. `zeta` and `b`: two numbers.
        """
        self.alpha, self.zeta, self.lam, self.eta = alpha, zeta, lam, eta
        self.a, self.b, self.bow, self.u_0 = a, b, bow, u_0
        self.d, self.d_0, self.count = d, d_0, plays
        self.origin, self.rho = origin, rho

    def __check_init__(self):
        check_shapes(self, ("alpha", "rho", "lam", "eta", "a"), ("bow", "u_0", "d_0", "origin"))
        for name in ("zeta", "b"):
            if jnp.shape(getattr(self, name)) != (2,):
                raise ValueError(
                    f"Argument `{name}` must be two numbers, but has shape "
                    f"{jnp.shape(getattr(self, name))}."
                )

    @classmethod
    def of(cls, operator: AbstractOperator, *, u_0: Any = 0.0) -> "GeneralRAPI":
        """The same function of the drive as `operator`, free to bend about `u_0`.

        `operator`: a `RAPI`, `FixedRAPI` or `MixedRAPI`; `u_0` counts from its origin.
        """
        names = ("zeta", "lam", "eta", "a", "b", "d", "d_0", "origin")
        same = {name: getattr(operator, name) for name in names}
        same |= {name: getattr(operator, name, 0.0) for name in ("alpha", "rho")}
        return cls._from_rapi(u_0=u_0, plays=operator.count, **same)

    @classmethod
    def _from_rapi(cls, *, zeta: Any, b: Any, **same: Any) -> "GeneralRAPI":
        """From the parameters of a `RAPI`: straight bounds, one growth, one decay."""
        zeta, b = (jnp.stack([x, jnp.zeros_like(x)]) for x in map(as_float64, (zeta, b)))
        return cls(**same, zeta=zeta, b=b)

    @classmethod
    @float64
    def initial_guesses(
        cls,
        recording: Recording,
        *,
        plays: int = 10,
        order: int = 3,
        each: Sequence[str] = (),
        count: int = 8,
    ) -> list["GeneralRAPI"]:
        """Those of `RAPI`, free to bend about the middle of the drives."""
        origin = drive_origin(recording)
        places = {"u_0": middle_drive(recording) - origin, "origin": origin}
        middle = eqx.Partial(cls._from_rapi, **{k: as_float64(at) for k, at in places.items()})
        return guess_shapes(middle, recording, plays=plays, order=order, each=each, count=count)

    def held(self, recording: Recording) -> set[str]:
        alike = one_kind_of_scan(recording)
        held = held_thresholds(self, recording, scale="alpha", alike=alike) | {"u_0"}
        if alike:
            each = jnp.ndim(self.alpha) > 0 or jnp.ndim(self.eta) > 0
            if "zeta" not in held:
                held.add("zeta" if each else "alpha")
            if jnp.ndim(self.a) > 0:
                held.add("b")
        return held

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        rank = jnp.arange(1.0, self.count + 1.0) / self.count
        growth = self.zeta[0] + self.zeta[1] * (rank - 0.5)
        alpha, rho = per_play(self.alpha, self.count), per_play(self.rho, self.count)
        r = alpha * rank * u_pp / 2.0 + rho * rank + growth * freq  # Eq. (11)
        p = per_play(self.a, self.count) * jnp.exp(-self.b[0] * r - self.b[1] * r**2)
        shape = (per_play(self.lam, self.count), per_play(self.eta, self.count))
        return Plays(r, *shape, p, self.bow, self.u_0)
