"""RA-PI with thresholds fixed in the drive's unit, as a classical piezo's are."""

from collections.abc import Sequence
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import as_float64, float64
from rapi_jax.recording._recording import Recording

from ._abstract_rapi import AbstractRAPI, held_thresholds
from ._base import FlexibleForm, per_play
from ._flexible_rapi import flexible_form
from ._guess import guess_shapes, largest_half_swing
from ._origin import drive_origin


class FixedRAPI(AbstractRAPI):
    r"""RA-PI with thresholds that are the same at every amplitude: $r_i = \rho_i\,i/N_1 + \zeta f$.

    Everything else is as in `RAPI`.

    | field | meaning | unit | equation |
    |---|---|---|---|
    | `rho` | widest play's threshold at rate 0; shared or one per play | V | ours |
    | `zeta` | growth of every threshold with scan rate | V/Hz | 11 |
    | `lam` | slope of the falling bound; shared or one per play | 1 | 9, 12 |
    | `eta` | intercept of the falling bound, in thresholds; shared or one per play | 1 | 9, 12 |
    | `a`, `b` | weights $p_i = a_i e^{-b r_i}$, `a` shared or one per play | GHz/V, 1/V | 14 |
    | `d` | polynomial from the first power on | GHz/V^k | 15 |
    | `d_0` | origin of the response | GHz | ours |
    | `origin` | the drive from which plays and polynomial count; held in fits | V | ours |

    With `lam` and `eta` 1, `zeta` and `b` 0 it is a `PI` with thresholds evenly spaced.

    At one scan rate all runs have the same thresholds, and `eta` cannot be told from their scale,
    whatever the amplitudes; nor can it where thresholds do not grow with rate.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import FixedRAPI
    >>> operator = FixedRAPI(rho=0.6, zeta=0.0, lam=1.0, eta=1.0, a=0.6, b=0.1, d=[18.8], plays=3)
    >>> rate, swings = jnp.array(10.0), jnp.array([2.0, 4.0])
    >>> [operator.plays(swing, rate).r.round(3).tolist() for swing in swings]  # V: the same
    [[0.2, 0.4, 0.6], [0.2, 0.4, 0.6]]
    """

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
    tied_first: ClassVar = ("rho", "lam", "eta")

    def __init__(
        self,
        *,
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
        """`plays` is N1, the size of `d` N2. `rho`, `lam`, `eta`, `a`: one number or `plays`."""
        self.rho, self.zeta, self.lam, self.eta = rho, zeta, lam, eta
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
    ) -> list["FixedRAPI"]:
        """The shapes drawn for `RAPI`, which hold at the largest amplitude of the recording.

        `each` may name "lam", "eta" and "rho"; "alpha" stands for "rho", as the threshold.
        """
        half = largest_half_swing(recording)

        def fixed(fields: dict[str, float], trial: int) -> dict[str, float]:
            del trial
            rest = {name: value for name, value in fields.items() if name != "alpha"}
            return {"rho": fields["alpha"] * half, **rest}

        each = ["rho" if name == "alpha" else name for name in each]
        build = eqx.Partial(cls, origin=as_float64(drive_origin(recording)))
        return guess_shapes(
            build, recording, plays=plays, order=order, each=each, count=count, law=fixed
        )

    def held(self, recording: Recording) -> set[str]:
        alike = recording.one_rate
        held = held_thresholds(self, recording, scale="rho", alike=alike)
        # With a threshold for each play, one rate does not tell its growth from itself.
        return held | {"zeta"} if alike and jnp.ndim(self.rho) > 0 else held

    def flexible(self, recording: Recording) -> FlexibleForm:
        return flexible_form(self, recording)

    @float64
    def thresholds(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Float[Array, " plays"]:
        del u_pp
        return per_play(self.rho, self.count) * self.rank + self.zeta * freq

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        # As in `RAPI`: the smallest threshold, rho / N1 + zeta f, is positive at the highest rate.
        del u_pp
        slopes = [1.0 / (self.count * f) for f in freq if f > 0]
        if jnp.ndim(self.rho) > 0 or not slopes:
            return {}
        return {("zeta", "rho"): -min(slopes)}
