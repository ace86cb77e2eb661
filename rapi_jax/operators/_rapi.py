"""The rate-dependent asymmetric Prandtl-Ishlinskii operator of the paper."""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64
from rapi_jax._recording import Recording
from rapi_jax.plays._plays import Plays

from ._base import AbstractOperator, Fields, check_shapes
from ._guess import TRIALS, draw, trials


def spread(value: Float[Array, "..."], count: int) -> Float[Array, " plays"]:
    """One value an operator, whether `value` is shared (a scalar) or already one each."""
    return jnp.broadcast_to(value, (count,))


class RAPI(AbstractOperator):
    r"""The RA-PI operator: $\sum_i p_i\,\Gamma_{r_i,\lambda_i,\eta_i}[u] + d_0 + \sum_k d_k u^k$.

    | field | meaning | unit | equation |
    |---|---|---|---|
    | `alpha` | widest play's threshold per half peak-to-peak drive; shared or one a play | 1 | 11 |
    | `zeta` | growth of every threshold with scan rate | V/Hz | 11 |
    | `lam` | slope of the falling bound; shared or one a play | 1 | 9, 12 |
    | `eta` | intercept of the falling bound, in thresholds; shared or one a play | 1 | 9, 12 |
    | `a`, `b` | weights $p_i = a_i e^{-b r_i}$, `a` shared or one a play | GHz/V, 1/V | 14 |
    | `d` | polynomial from the first power on | GHz/V^k | 15 |
    | `d_0` | origin of the response, which the paper leaves undefined | GHz | ours |

    Thresholds (Eq. 11, where the paper gives no index):
    $r_i(f) = \alpha_i (i/N_1) u_{pp}/2 + \zeta f$, $i = 1..N_1$. They must stay positive over the
    rates in use; fits hold them there.

    Only `r (1 + eta)` and `b r` are seen in one scan, up to an offset: with one rate and amplitude,
    or with an origin of its own for every run, `eta` cannot be told from the scale of the
    thresholds.
    """

    alpha: Float[Array, "*plays"] = parameter(unit="1", positive=True)
    zeta: Float[Array, ""] = parameter(unit="{u}/Hz", positive=True)
    lam: Float[Array, "*plays"] = parameter(unit="1", bounds=(0.05, 20.0))
    eta: Float[Array, "*plays"] = parameter(unit="1", bounds=(-1.0, 100.0))
    a: Float[Array, "*plays"] = parameter(unit="{x}/{u}", positive=True)
    b: Float[Array, ""] = parameter(unit="1/{u}")
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
        plays: int = 10,
    ):
        """`plays` is N1, the size of `d` N2. `alpha`, `lam`, `eta`, `a`: one number or `plays`."""
        self.alpha, self.zeta, self.lam, self.eta = alpha, zeta, lam, eta
        self.a, self.b, self.d, self.d_0 = a, b, d, d_0
        self.count = plays

    def __check_init__(self):
        check_shapes(self, ("alpha", "lam", "eta", "a"), ("zeta", "b", "d_0"))

    @classmethod
    def guess(
        cls, recording: Recording, *, plays: int = 10, order: int = 3, each: Sequence[str] = ()
    ) -> "RAPI":
        """A first model from the data alone, to start a fit from.

        `plays` is N1, `order` N2. `each` names what is to have a value for each play ("lam", "eta",
        "alpha") instead of a shared one. `guesses` gives several, best first.
        """
        return cls.guesses(recording, plays=plays, order=order, each=each)[0]

    @classmethod
    @float64
    def guesses(
        cls,
        recording: Recording,
        *,
        plays: int = 10,
        order: int = 3,
        each: Sequence[str] = (),
        count: int = 8,
    ) -> list["RAPI"]:
        """The best `count` of a few hundred shapes of the memory function, the rest solved for."""
        unknown = set(each) - {"alpha", "lam", "eta"}
        if unknown:
            raise ValueError(f"Argument `each` may name alpha, lam and eta, but names {unknown}.")

        def build(fields: dict[str, float], a: float, d: Any, d_0: float) -> RAPI:
            wide = {k: np.full(plays, v) if k in each else v for k, v in fields.items()}
            return cls(**wide, a=a, d=d, d_0=d_0, plays=plays)

        drawn = [draw(recording, i) for i in range(TRIALS)]
        shapes = [(f, build(f, 1.0, np.zeros(order), 0.0)) for f in drawn]
        found = trials(recording, shapes, order)[:count]
        return [build(t.fields, t.scale, t.d, t.d_0) for t in found]

    @float64
    def thresholds(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Float[Array, " plays"]:
        """The thresholds of a run, in the drive's unit."""
        rank = jnp.arange(1.0, self.count + 1.0) / self.count
        return spread(self.alpha, self.count) * rank * u_pp / 2.0 + self.zeta * freq  # Eq. (11)

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        r = self.thresholds(u_pp, freq)
        p = spread(self.a, self.count) * jnp.exp(-self.b * r)  # below Eq. (14)
        return Plays(r, spread(self.lam, self.count), spread(self.eta, self.count), p)

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        # The smallest threshold, alpha u_pp / (2 N1) + zeta f, is positive for all runs together if
        # and only if zeta > -m alpha; with an alpha for each play zeta itself is kept positive.
        slopes = [pp / (2 * self.count * f) for pp, f in zip(u_pp, freq, strict=True) if f > 0]
        if jnp.ndim(self.alpha) > 0 or not slopes:
            return {}
        return {("zeta", "alpha"): -min(slopes)}
