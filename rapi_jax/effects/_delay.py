"""A pure delay between drive and reading."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64
from rapi_jax.sampling._corners import corners

from .base._by_place import AbstractInvertible, AbstractOpticalEffect
from .base._derived import Derived, ScanRange
from .base._effect import AbstractEffect
from .base._linear import AbstractLinearEffect
from .base._residual_summary import ResidualSummary


class Delay(AbstractOpticalEffect, AbstractLinearEffect, AbstractInvertible):
    r"""A pure delay between the drive and the reading: $\nu(t - \tau)$.

    Buffers, filters of high order and triggers delay by 1 us to 1 ms. A delay of the drive equals
    one of the operator's response, since the operator does not depend on absolute time. The
    response is interpolated linearly between samples; turning points between samples are nodes of
    the grid and stay sharp. It comes first behind the operator: effects fixed in session time
    (pickup, drift) come after it and are not delayed.

    Before the first sample the response is constant.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Delay
    >>> time = jnp.arange(4.0) * 0.001
    >>> Delay.at(tau=0.0005)(time, 10.0 * jnp.arange(4.0)).tolist()  # GHz
    [0.0, 5.0, 15.0, 25.0]
    """

    tau: Float[Array, ""] = parameter(unit="s", default=0.0, bounds=(0.0, 0.2))

    name: ClassVar[str] = "delay"
    label: ClassVar[str] = "a delay between drive and reading"
    signature_axis: ClassVar = "since_turn"
    remedy: ClassVar[str] = (
        "Set the latency of the reading (`rapi import --response-lag`, in a manifest "
        "`response_lag_s`), or compensate with the model."
    )

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        phase = 360.0 * scan.fastest_hz
        return (Derived("phase at the fastest scan", "deg", "tau", lambda tau: phase * tau),)

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """Four delays, from one that shows at turns alone to one of a tenth of a branch."""
        return [cls.at(tau=tau) for tau in summary.lags if tau < 0.2]

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        asked = jnp.maximum(t - self.tau, t[0])
        # The first sample not before the time asked for: itself where there is no delay.
        after = jnp.searchsorted(t, asked, side="left", method="scan")
        before = jnp.maximum(after - 1, 0)
        step = t[after] - t[before]
        share = (t[after] - asked) / jnp.where(step > 0, step, 1.0)
        return nu[after] - share * (nu[after] - nu[before])

    def transfer(self, hertz: Float[np.ndarray, " freq"]) -> Complex[np.ndarray, " freq"]:
        tau = float(self.tau)
        return np.exp(-2j * np.pi * hertz * tau)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal advanced by `tau`, linear between samples and sharp turning points."""
        if float(self.tau) == 0.0:
            return signal
        value, clock = np.asarray(signal), np.asarray(t) - float(t[0])
        period = clock.size * float(clock[1])
        at, height = corners(np.tile(value, 3))
        at = (at - clock.size) * float(clock[1])
        inside = (at > 0) & (at < period)
        known = np.concatenate([clock, at[inside]])
        levels = np.concatenate([value, height[inside]])
        return jnp.asarray(np.interp(clock + float(self.tau), known, levels, period=period))
