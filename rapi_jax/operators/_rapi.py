"""The rate-dependent asymmetric Prandtl-Ishlinskii operator of the paper."""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import as_float64, float64
from rapi_jax.recording._recording import Recording

from ._abstract_rapi import AbstractRAPI, held_thresholds, one_kind_of_scan
from ._base import FlexibleForm, per_play
from ._flexible_rapi import flexible_form
from ._guess import guess_shapes
from ._origin import drive_origin


class RAPI(AbstractRAPI):
    r"""The RA-PI operator: $\sum_i p_i\,\Gamma_{r_i,\lambda_i,\eta_i}[u] + d_0 + \sum_k d_k u^k$.

    | field | meaning | unit | equation |
    |---|---|---|---|
    | `alpha` | widest play's threshold per half peak-to-peak drive, shared or per play | 1 | 11 |
    | `zeta` | growth of every threshold with scan rate | V/Hz | 11 |
    | `lam` | slope of the falling bound; shared or one per play | 1 | 9, 12 |
    | `eta` | intercept of the falling bound, in thresholds; shared or one per play | 1 | 9, 12 |
    | `a`, `b` | weights $p_i = a_i e^{-b r_i}$, `a` shared or one per play | GHz/V, 1/V | 14 |
    | `d` | polynomial from the first power on | GHz/V^k | 15 |
    | `d_0` | origin of the response, which the paper leaves undefined | GHz | ours |
    | `origin` | the drive from which plays and polynomial count; held in fits | V | ours |

    Thresholds (Eq. 11, where the paper gives no index):
    $r_i(f) = \alpha_i (i/N_1) u_{pp}/2 + \zeta f$, $i = 1..N_1$. They must stay positive over the
    rates in use; fits hold them there.

    Only `r (1 + eta)` and `b r` are seen in one scan, up to an offset: with one rate and amplitude,
    or with an origin of its own for every run, `eta` cannot be told from the scale of the
    thresholds.

    >>> from rapi_jax import ECDL, RAPI, predict, triangle
    >>> operator = RAPI(alpha=0.28, zeta=0.0067, lam=1.6, eta=1.0, a=0.63, b=0.1, d=(18.8, -1.08))
    >>> (drive,) = triangle(10.0, amplitude=4.5, bias=3.0, samples=100)
    >>> round(float(predict(ECDL(operator), drive).max()), 1)  # GHz
    98.2
    """

    alpha: Float[Array, "*plays"] = parameter(unit="1", positive=True)
    zeta: Float[Array, ""] = parameter(unit="{u}/Hz", positive=True)
    lam: Float[Array, "*plays"] = parameter(unit="1", bounds=(0.05, 20.0))
    eta: Float[Array, "*plays"] = parameter(unit="1", bounds=(-1.0, 100.0))
    a: Float[Array, "*plays"] = parameter(unit="{x}/{u}", positive=True)
    b: Float[Array, ""] = parameter(unit="1/{u}")
    d: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    d_0: Float[Array, ""] = parameter(unit="{x}", linear=True)
    origin: Float[Array, ""] = parameter(unit="{u}", default=0.0, held=True)
    count: int = eqx.field(static=True, kw_only=True)
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
        origin: Any = 0.0,
        plays: int = 10,
    ):
        """`plays` is N1, the size of `d` N2. `alpha`, `lam`, `eta`, `a`: one number or `plays`."""
        self.alpha, self.zeta, self.lam, self.eta = alpha, zeta, lam, eta
        self.a, self.b, self.d, self.d_0 = a, b, d, d_0
        self.origin = origin
        self.count = plays

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
    ) -> list["RAPI"]:
        """The best `count` of a few hundred shapes of the memory function, the rest solved for.

        `each` may name "lam", "eta" and "alpha". They count the drive from `drive_origin`.
        """
        build = eqx.Partial(cls, origin=as_float64(drive_origin(recording)))
        return guess_shapes(build, recording, plays=plays, order=order, each=each, count=count)

    def held(self, recording: Recording) -> set[str]:
        alike = one_kind_of_scan(recording)
        return held_thresholds(self, recording, scale="alpha", alike=alike)

    def flexible(self, recording: Recording) -> FlexibleForm:
        return flexible_form(self, recording)

    @float64
    def thresholds(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Float[Array, " plays"]:
        alpha = per_play(self.alpha, self.count)
        return alpha * self.rank * u_pp / 2.0 + self.zeta * freq  # Eq. (11)

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        # The smallest threshold, alpha u_pp / (2 N1) + zeta f, is positive for all runs together if
        # and only if zeta > -m alpha; with an alpha for each play zeta itself is kept positive.
        slopes = [pp / (2 * self.count * f) for pp, f in zip(u_pp, freq, strict=True) if f > 0]
        if jnp.ndim(self.alpha) > 0 or not slopes:
            return {}
        return {("zeta", "alpha"): -min(slopes)}
