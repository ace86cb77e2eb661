"""Creep: the slow part of a piezo's response, logarithmic in time."""

from typing import ClassVar

import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractInvertible, AbstractOpticalEffect
from .base._derived import Derived, ScanRange
from .base._first_order_lags import invert_linear, respond_from_rest
from .base._linear import ALWAYS_ON_S, AbstractLagEffect, Modes, Past
from .base._residual_summary import ResidualSummary

FASTEST_S, SLOWEST_S = 5e-3, 20.0
# Two a decade: between them the step response is logarithmic in time to 3 parts in 1000.
_LAGS = 8
_NO_RESTS_S = 2.0 * ALWAYS_ON_S


class Creep(AbstractOpticalEffect, AbstractLagEffect, AbstractInvertible):
    r"""Slow relaxation: $\nu + \frac{g}{K} \sum_k (L_k[\nu] - \nu)$, $L_k$ a lag by $\tau_k$.

    The lags stand $K$ a decade from `fastest_s` to 20 s. With 5 ms, after a step of 1 the response
    jumps at once to $1 - g N/K$ ($N$ lags, $N/K$ = 4.1), grows as $1 + g \log_{10}(t/t_s)$, $t_s$ =
    20.3 s, while 10 ms < t < 2 s (its slope within 6 % of $g$ a decade), levels off, and ends at 1:
    the operator is the settled response of the device.

    The usual form is $\nu + g' \frac{1}{K} \sum_k L_k[\nu - \nu_{rest}]$, with an operator that is
    the response before any creep. Both are one family: $g' = g / (1 - g N/K)$, and the operator
    about the resting point is larger here by $1 + g' N/K$. Adding creep to an operator thus changes
    its fitted gain, by some 4 g.

    `gain` is that of a decade in time, as a share of the settled response. The lags outlast a run,
    and continue from one to the next by their times in the session. What a recording does not show
    is a parameter: `history`, the state before the session, from 0, at rest, to 1, long driven as
    in the first run; `lead_s` and `lead_periods`, how long each run's drive was on before its first
    sample, after a rest, in seconds and in periods besides (`lead_s` long: it was on since the run
    before, without rests); `rest`, the response at rest, counted from the first run's first value
    as a share of its range.

    Creep as a sum of first-order lags: Actuators 13, 534.

    >>> import numpy as np
    >>> from rapi_jax.effects import Creep
    >>> creep = Creep.at(gain=0.01)  # 1 % a decade of time
    >>> slow, fast = np.abs(creep.transfer(np.array([1e-4, 100.0])))
    >>> bool(slow > fast)
    True
    """

    name: ClassVar[str] = "creep"
    label: ClassVar[str] = "creep of the piezo"
    signature_axis: ClassVar = "since_turn"
    remedy: ClassVar[str] = (
        "Compensate with the corrected model; let the device run in before a scan."
    )
    session: ClassVar[bool] = True
    gain: Float[Array, ""] = parameter(unit="1/decade", default=0.0, bounds=(-0.02, 0.2))  # g
    history: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(0.0, 1.0))

    lead_s: Float[Array, ""] = parameter(
        unit="s", default=_NO_RESTS_S, bounds=(0.0, 2 * _NO_RESTS_S)
    )
    rest: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(-1.0, 1.0))
    lead_periods: Float[Array, ""] = parameter(unit="1", default=0.0, bounds=(0.0, 20.0))
    fastest_s: Float[Array, ""] = parameter(unit="s", default=FASTEST_S, bounds=(2e-4, 0.2))

    def kind(self) -> str:
        return "without rests" if float(self.lead_s) > ALWAYS_ON_S else "with rests"

    @float64
    def modes(self) -> Modes:
        decades = jnp.log10(SLOWEST_S / self.fastest_s)
        tau = self.fastest_s * 10.0 ** (decades * jnp.linspace(0.0, 1.0, _LAGS))
        return Modes(tau, jnp.full((_LAGS,), self.gain * decades / (_LAGS - 1)))

    def past(self) -> Past:
        return Past(self.history, self.rest, self.lead_s, self.lead_periods)

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The response of one run that begins at rest."""
        return respond_from_rest(self.modes(), t, nu)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return invert_linear(self.modes(), t, signal)

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        del scan
        return (Derived("creep a decade of time", "%", "gain", lambda gain: 100.0 * gain),)

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[Creep]":
        """Long driven or fresh without rests; and rested at the middle, by where a run begins.

        The amplitude is a share of the response, and the time scales are the piezo's.
        """
        driven = [
            (g, {"history": h, "lead_periods": 1.0}) for g in (0.01, 0.04) for h in (0.05, 0.95)
        ]
        leads = zip(THRESHOLDS.creep_lead_s, THRESHOLDS.creep_lead_periods, strict=True)
        rested = [
            (0.03, {"history": 0.05, "rest": rest, "lead_s": lead_s, "lead_periods": periods})
            for lead_s, periods in leads
            for rest in (0.5, 0.0, -0.5)  # a run begins at its least, its middle, its largest
        ]
        return [cls.at(gain=g, **past) for g, past in driven + rested]
