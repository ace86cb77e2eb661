"""The paper's inverse operator: optical frequency to the drive that makes it."""

from collections.abc import Sequence
from functools import partial
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64
from rapi_jax.plays._plays import Plays
from rapi_jax.recording._recording import Recording

from ._base import AbstractOperator, Fields, check_shapes, per_play
from ._guess import evaluate_guesses, one_response
from ._inverse_guess import find_contacts, fit_threshold_law, fit_weight_law
from ._thresholds import THRESHOLDS

_SHARED = ("s_1", "s_2", "s_3", "sigma", "epsilon", "kappa", "g_0", "v_0")


class InverseRAPI(AbstractOperator):
    r"""The inverse RA-PI: $\sum_i q_i\,\Phi_{z_i,\lambda_i,\eta_i}[v - v_0] + g_0
    + \sum_k g_k (v - v_0)^k$, from optical frequency $v$ to drive (Eqs. 18 to 23).

    | field | meaning | unit | equation |
    |---|---|---|---|
    | `s_1`, `s_2`, `s_3` | thresholds $z_i(f) = s_1 i^2 + s_2 i + s_3 + \kappa f$ | GHz | 18, 19 |
    | `kappa` | growth of every threshold with scan rate | GHz/Hz | 19 |
    | `sigma`, `epsilon` | weights $q_i = \sigma i^\varepsilon$ | V/GHz, 1 | 18 |
    | `lam` | slope of the falling bound; shared or one per play | 1 | 20 |
    | `eta` | intercept of the falling bound, in thresholds; shared or one per play | 1 | 20 |
    | `g` | polynomial from the first power on | V/GHz^k | 22 |
    | `g_0` | the drive at the origin, which the paper leaves out | V | ours |
    | `v_0` | the frequency from which plays and polynomial count | GHz | ours |

    The plays recurse on their own outputs; Eq. 20 prints those of the forward model. Weights
    are negative where those of the forward operator are positive (Eq. 17), so `sigma` has either
    sign. With `lam` other than 1 plays depend on where zero is, and fringes give frequency up to a
    constant: `v_0`, not fitted unless asked for, ties the operator to the frequencies that it was
    identified on.

    Thresholds do not depend on the amplitude, unlike those of `RAPI`: valid near the span it was
    identified on. They must be positive over the rates in use; fits hold them there.

    >>> import jax.numpy as jnp
    >>> from rapi_jax import InverseRAPI
    >>> operator = InverseRAPI(
    ...     s_1=0.1, s_2=0.5, s_3=0.2, kappa=0.01, sigma=-0.003, epsilon=0.5, lam=1.0, eta=1.0,
    ...     g=[0.05], plays=3,
    ... )
    >>> operator.plays(jnp.array(60.0), jnp.array(10.0)).r.round(3).tolist()  # GHz
    [0.9, 1.7, 2.7]
    """

    s_1: Float[Array, ""] = parameter(unit="{u}", positive=True)
    s_2: Float[Array, ""] = parameter(unit="{u}", positive=True)
    s_3: Float[Array, ""] = parameter(unit="{u}", positive=True)
    kappa: Float[Array, ""] = parameter(unit="{u}/Hz", positive=True)
    sigma: Float[Array, ""] = parameter(unit="{x}/{u}")
    epsilon: Float[Array, ""] = parameter(unit="1", bounds=(-10.0, 10.0))
    lam: Float[Array, "*plays"] = parameter(unit="1", bounds=(0.05, 20.0))
    eta: Float[Array, "*plays"] = parameter(unit="1", bounds=(-1.0, 100.0))
    g: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    g_0: Float[Array, ""] = parameter(unit="{x}", linear=True)
    v_0: Float[Array, ""] = parameter(unit="{u}")
    count: int = eqx.field(static=True, kw_only=True)
    fields: ClassVar = Fields("g", "g_0", "v_0")
    weight: ClassVar = "sigma"

    def __init__(
        self,
        *,
        s_1: Any,
        s_2: Any,
        s_3: Any,
        kappa: Any,
        sigma: Any,
        epsilon: Any,
        lam: Any,
        eta: Any,
        g: Any,
        g_0: Any = 0.0,
        v_0: Any = 0.0,
        plays: int = 10,
    ):
        """`plays` is N1, the size of `g` N2. `lam`, `eta`: one number or `plays`."""
        self.s_1, self.s_2, self.s_3, self.kappa = s_1, s_2, s_3, kappa
        self.sigma, self.epsilon, self.lam, self.eta = sigma, epsilon, lam, eta
        self.g, self.g_0, self.v_0 = g, g_0, v_0
        self.count = plays

    def __check_init__(self):
        check_shapes(self, ("lam", "eta"), _SHARED)

    @classmethod
    @float64
    def guess_inverses(
        cls,
        forward: AbstractOperator,
        recording: Recording,
        *,
        plays: int | None = None,
        order: int = 4,
        each: Sequence[str] = ("lam",),
        count: int = 4,
    ) -> list["InverseRAPI"]:
        """Initial inverses of `forward` for a fit to the swapped `recording`, best first.

        `recording`: frequency as drive and drive as response. `plays` is N1, by default that of
        `forward`; `order` N2; `each` names what has a value for each play: "lam", "eta".

        Thresholds and weights follow Eq. 17 at each of the rates, extended to asymmetric plays,
        fitted by the compact forms of Eqs. 18 and 19; the polynomial is fitted to the recording.
        All have one origin, and differ in how `lam` falls from play to play.
        """
        unknown = set(each) - {"lam", "eta"}
        if unknown:
            raise ValueError(f"Argument `each` may name lam and eta, but names {unknown}.")
        n = forward.count if plays is None else plays
        drive = np.concatenate([run.response[run.valid] for run in recording.runs])
        ends = float(drive.min()), float(drive.max())
        rates = recording.rates
        found = [find_contacts(forward, rate, *ends, n) for rate in rates]
        bottom, top = min(c.low for c in found), max(c.high for c in found)
        v_0 = bottom + THRESHOLDS.inverse_origin * (top - bottom)
        moves = np.array([c.moves for c in found])
        lams = np.array([c.lam for c in found])
        usual = float(np.median(lams[moves])) if moves.any() else 1.0
        lam = np.clip(np.where(moves, lams, usual).mean(axis=0), *THRESHOLDS.inverse_lam_range)
        own = "lam" in each
        lam = lam if own else np.full(n, lam.mean())
        z = np.array([c.z(lam, v_0) for c in found])
        sigma, epsilon = fit_weight_law(np.mean([c.q for c in found], axis=0))
        # Plays of a forward model that fits well may still lie where none belongs; then symmetric
        # ones, spread over the range, explain more, and come first.
        even = np.tile(
            THRESHOLDS.inverse_even_width * (top - bottom) * np.arange(1, n + 1) / n,
            (len(rates), 1),
        )
        families = [
            (lam, fit_threshold_law(z, np.array(rates), moves), sigma, epsilon),
            (
                np.ones(n),
                fit_threshold_law(even, np.array(rates), moves),
                np.copysign(1.0 / n, sigma),
                0.0,
            ),
        ]
        ranked = []
        for lam, (s, kappa), sigma, epsilon in families:
            fields: dict[str, Any] = dict(s_1=s[0], s_2=s[1], s_3=s[2], kappa=kappa)
            fields |= dict(epsilon=epsilon, v_0=v_0, plays=n)
            fields["eta"] = np.ones(n) if "eta" in each else 1.0
            members = []
            for fall in THRESHOLDS.inverse_lam_falls if own else (0.0,):
                fields["lam"] = lam * np.exp(fall * np.linspace(0.5, -0.5, n)) if own else lam[0]
                shape = cls(**fields, sigma=sigma, g=np.zeros(order))
                (trial,) = evaluate_guesses(recording, partial(one_response, shape), [{}], order, 1)
                scale = trial.scale if trial.scale > 0 else 1.0
                full = cls(**fields, sigma=sigma * scale, g=trial.d, g_0=trial.d_0)
                members.append((trial.cost, full))
            ranked.append(members)
        ranked.sort(key=lambda members: min(cost for cost, _ in members))
        return [guess for members in ranked for _, guess in members][:count]

    def held(self, recording: Recording) -> set[str]:
        """The origin `v_0`; with one rate `kappa` and `eta` (one per play: `s_1` to `s_3`)."""
        thresholds = ("s_1", "s_2", "s_3")
        held = {"v_0", *thresholds[: max(3 - self.count, 0)]}
        if recording.one_rate:
            held |= {"kappa"} | (set(thresholds) if jnp.ndim(self.eta) > 0 else {"eta"})
        return held

    @float64
    def thresholds(self, freq: Float[Array, ""]) -> Float[Array, " plays"]:
        """The thresholds at scan rate `freq` (Hz), in the unit of the frequency `v`."""
        i = jnp.arange(1.0, self.count + 1.0)
        return self.s_1 * i**2 + self.s_2 * i + self.s_3 + self.kappa * freq  # Eq. (19)

    def plays(self, u_pp: Float[Array, ""], freq: Float[Array, ""]) -> Plays:
        del u_pp
        i = jnp.arange(1.0, self.count + 1.0)
        q = self.sigma * i**self.epsilon  # Eq. (18)
        lam, eta = per_play(self.lam, self.count), per_play(self.eta, self.count)
        return Plays(self.thresholds(freq), lam, eta, q)  # Eqs. (20), (21)

    def couplings(self, u_pp: list[float], freq: list[float]) -> dict[tuple[str, str], float]:
        # Over i = 1 to N1 a quadratic is positive where its three Bernstein coefficients are; these
        # are linear in s_1, s_2, s_3. At the lowest rate: kappa is not negative.
        del u_pp
        low, m = min(freq), max(self.count - 1.0, 1.0)
        if self.count < 3:  # a line or a point: s_1 (and s_2) say nothing
            return {("s_3", "s_2"): -1.0, ("s_3", "kappa"): -low}
        middle, last = 2.0 / m + 4.0 / m**2, 1.0 / m**2
        first = (1.0 + 1.0 / m) ** 2
        return {
            ("s_1", "s_2"): -2.0 / m**2 / middle,
            ("s_1", "s_3"): 1.0 / m**2 / first,
            ("s_2", "s_1"): -2.0 / m**2 / last,
            ("s_2", "s_3"): -(2.0 / m + 2.0 / m**2) / first,
            ("s_3", "s_1"): 1.0 / m**2 / last,
            ("s_3", "s_2"): -(2.0 / m + 2.0 / m**2) / middle,
            ("s_3", "kappa"): -low,
        }
