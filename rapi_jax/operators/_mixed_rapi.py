"""RA-PI with thresholds of which a part grows with the swing, and a part is fixed."""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import as_float64, float64
from rapi_jax.recording._recording import Recording

from ._abstract_rapi import AbstractRAPI, held_thresholds, one_amplitude, one_kind_of_scan
from ._base import FlexibleForm, per_play
from ._flexible_rapi import flexible_form
from ._guess import guess_shapes, largest_half_swing
from ._origin import drive_origin

_GOLDEN = (5**0.5 - 1.0) / 2.0  # multiples of it, less their whole part, cover 0 to 1 evenly


class MixedRAPI(AbstractRAPI):
    r"""RA-PI between `RAPI` and `FixedRAPI`: $r_i = (\alpha_i u_{pp}/2 + \rho_i)\,i/N_1 + \zeta f$.

    Everything else is as in `RAPI`.

    | field | meaning | unit | equation |
    |---|---|---|---|
    | `alpha` | widest play's threshold per half peak-to-peak drive, shared or per play | 1 | 11 |
    | `rho` | the fixed part of the widest play's threshold; shared or one per play | V | ours |
    | `zeta` | growth of every threshold with scan rate | V/Hz | 11 |
    | `lam` | slope of the falling bound; shared or one per play | 1 | 9, 12 |
    | `eta` | intercept of the falling bound, in thresholds; shared or one per play | 1 | 9, 12 |
    | `a`, `b` | weights $p_i = a_i e^{-b r_i}$, `a` shared or one per play | GHz/V, 1/V | 14 |
    | `d` | polynomial from the first power on | GHz/V^k | 15 |
    | `d_0` | origin of the response | GHz | ours |
    | `origin` | the drive from which plays and polynomial count; held in fits | V | ours |

    With `rho` 0 it is `RAPI`, with `alpha` 0 `FixedRAPI`. One amplitude does not tell the two
    apart: `rho` is held there.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import MixedRAPI
    >>> operator = MixedRAPI(
    ...     alpha=0.3, rho=0.2, zeta=0.0, lam=1.0, eta=1.0, a=0.6, b=0.1, d=[18.8], plays=2
    ... )
    >>> rate, swings = jnp.array(10.0), jnp.array([2.0, 4.0])
    >>> [operator.plays(swing, rate).r.round(3).tolist() for swing in swings]  # V
    [[0.25, 0.5], [0.4, 0.8]]
    """

    alpha: Float[Array, "*plays"] = parameter(unit="1", positive=True)
    rho: Float[Array, "*plays"] = parameter(unit="{u}", positive=True)
    zeta: Float[Array, ""] = parameter(unit="{u}/Hz", positive=True)
    lam: Float[Array, "*plays"] = parameter(unit="1", bounds=(0.05, 20.0))
    eta: Float[Array, "*plays"] = parameter(unit="1", bounds=(-1.0, 100.0))
    a: Float[Array, "*plays"] = parameter(unit="{x}/{u}", positive=True)
    b: Float[Array, ""] = parameter(unit="1/{u}")
    d: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    d_0: Float[Array, ""] = parameter(unit="{x}", linear=True)
    origin: Float[Array, ""] = parameter(unit="{u}", default=0.0, held=True)
    count: int = eqx.field(static=True, kw_only=True)
    tied_first: ClassVar = ("alpha", "rho", "lam", "eta")

    def __init__(
        self,
        *,
        alpha: Any,
        rho: Any,
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
        """`plays` is N1, the size of `d` N2.

        `alpha`, `rho`, `lam`, `eta`, `a`: one number or `plays`.
        """
        self.alpha, self.rho, self.zeta, self.lam, self.eta = alpha, rho, zeta, lam, eta
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
    ) -> list["MixedRAPI"]:
        """The shapes drawn for `RAPI`, a part of each threshold fixed at the largest amplitude.

        `each` may name "lam", "eta", "alpha" and "rho".
        """
        half, single = largest_half_swing(recording), one_amplitude(recording)

        def mixed(fields: dict[str, float], trial: int) -> dict[str, float]:
            part = 0.0 if single else trial * _GOLDEN % 1.0
            alpha = fields["alpha"]
            return fields | {"alpha": (1.0 - part) * alpha, "rho": part * alpha * half}

        build = eqx.Partial(cls, origin=as_float64(drive_origin(recording)))
        return guess_shapes(
            build, recording, plays=plays, order=order, each=each, count=count, law=mixed
        )

    def held(self, recording: Recording) -> set[str]:
        held = held_thresholds(self, recording, scale="alpha", alike=one_kind_of_scan(recording))
        return held | {"rho"} if one_amplitude(recording) else held

    def flexible(self, recording: Recording) -> FlexibleForm:
        return flexible_form(self, recording)

    @float64
    def thresholds(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Float[Array, " plays"]:
        alpha, rho = per_play(self.alpha, self.count), per_play(self.rho, self.count)
        return alpha * self.rank * u_pp / 2.0 + rho * self.rank + self.zeta * freq  # Eq. (11)

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        # The smallest threshold, (alpha u_pp / 2 + rho) / N1 + zeta f, is positive in every run if
        # zeta > -m alpha - n rho, with the least of each over the runs; where these are not of the
        # same run, that is a little more than is needed.
        moving = [(pp, f) for pp, f in zip(u_pp, freq, strict=True) if f > 0]
        if jnp.ndim(self.alpha) > 0 or jnp.ndim(self.rho) > 0 or not moving:
            return {}
        return {
            ("zeta", "alpha"): -min(pp / (2 * self.count * f) for pp, f in moving),
            ("zeta", "rho"): -min(1.0 / (self.count * f) for _, f in moving),
        }
