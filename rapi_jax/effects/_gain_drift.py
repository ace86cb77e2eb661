"""A gain that changes in the course of a session."""

from collections.abc import Iterable
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractCouplingEffect
from .base._contribution import Contribution
from .base._derived import Derived, ScanRange
from .base._first_guess import fit_amplitude
from .base._random_walk import anew_in_each_run, random_walk
from .base._residual_summary import ResidualSummary


class GainDrift(AbstractCouplingEffect):
    r"""A gain that drifts: $\nu + k \tau (1 - e^{-(t-t_0)/\tau})(\nu - \nu_c - c)$.

    `rate` is $k$, 1/s, at first; with a long `tau` ($\tau$, s) the gain is straight in the
    session's time. $\nu_c$ is the run's response where the drive crosses the middle of its range,
    mean of both directions; `centre` $c$ the offset of the fixed point from there; `start` $t_0$,
    s. It does not depend on the history of the drive, as creep does; no periodic drive compensates
    it. Typically 0.01 to 3 % in a session.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import GainDrift
    >>> time, nu, drive = jnp.array([0.0, 100.0]), jnp.array([50.0, 50.0]), jnp.array([3.0, 3.0])
    >>> GainDrift.at(rate=1e-6)(time, nu, drive).round(3).tolist()  # GHz
    [50.0, 50.0]
    """

    name: ClassVar[str] = "gain_drift"
    label: ClassVar[str] = "drift of the gain"
    signature_axis: ClassVar = "gain"
    remedy: ClassVar[str] = "Stabilise temperature; identify again before a long session."
    steady: ClassVar[bool] = False
    rate: Float[Array, ""] = parameter(unit="1/s", default=0.0, bounds=(-10.0, 10.0))  # k
    centre: Float[Array, ""] = parameter(unit="{x}", default=0.0, held=True)
    start: Float[Array, ""] = parameter(unit="s", default=0.0, held=True)
    tau: Float[Array, ""] = parameter(unit="s", default=1e6, bounds=(1e-2, 1e7))

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"], u: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        about = response_at_centre(nu, u) + self.centre
        gain = -self.rate * self.tau * jnp.expm1(-(t - self.start) / self.tau)
        return nu + gain * (nu - about)

    def derived(self, scan: ScanRange) -> tuple[Derived, ...]:
        del scan
        return (Derived("change of gain a minute", "%", "rate", lambda rate: 6000.0 * rate),)

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """A gain that changes in any way which is slower than a run."""
        count = THRESHOLDS.slow_functions * here.rates.size
        about = self._about_centre(here)
        return [here.scaled(random_walk(here.time, count, n) * about) for n in (1.0, 2.0)]

    def rival_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """A gain that begins anew with each run: an effect of how it was driven before."""
        about = self._about_centre(here)
        for part in anew_in_each_run(here.time, here.run):  # and as much of the drift as is likely
            yield here.scaled(np.vstack([part * about, here.added]))

    def _about_centre(self, here: Contribution) -> Float[np.ndarray, " samples"]:
        """The response less the fixed point of each run."""
        about = response_at_centres(here.before, here.drive, here.run) + float(self.centre)
        return here.before - about

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[GainDrift]":
        start = float(summary.time.min())
        about = response_at_centres(summary.response, summary.drive, summary.run)
        found = fit_amplitude(summary, (summary.time - start) * (summary.response - about))
        rates = np.clip([found, -found], -5.0, 5.0)
        tau = float(np.clip(5.0 * summary.duration_s, 0.02, 5e6))
        return [cls.at(rate=rate, start=start, tau=tau) for rate in rates]


def response_at_centres(
    nu: Float[np.ndarray, " samples"], u: Float[np.ndarray, " samples"], run: np.ndarray
) -> Float[np.ndarray, " samples"]:
    """`response_at_centre` of each sample's run."""
    about = np.zeros(nu.size)
    for k in np.unique(run):
        mine = run == k
        about[mine] = response_at_centre(nu[mine], u[mine], np)
    return about


def response_at_centre(nu: Any, u: Any, xp: Any = jnp) -> Any:
    """The response where the drive crosses the middle of its range, mean of both directions.

    That of the first sample where it never crosses. `xp`: the arrays' module, JAX's or NumPy.
    """
    level = (xp.max(u) + xp.min(u)) / 2.0
    above = u >= level
    crossed = above[1:] != above[:-1]
    rise = xp.where(crossed, u[1:] - u[:-1], 1.0)
    at = nu[:-1] + (level - u[:-1]) / rise * (nu[1:] - nu[:-1])

    def mean(side: Any) -> tuple[Any, Any]:
        count = xp.sum(side.astype(nu.dtype))
        return xp.sum(xp.where(side, at, 0.0)) / xp.maximum(count, 1.0), count > 0

    up, rises = mean(crossed & above[1:])
    down, falls = mean(crossed & ~above[1:])
    sides = rises.astype(nu.dtype) + falls.astype(nu.dtype)
    return xp.where(sides > 0, (up + down) / xp.maximum(sides, 1.0), nu[0])
