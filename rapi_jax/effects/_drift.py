"""Drift of the optical frequency in the course of a session."""

from collections.abc import Iterable, Iterator
from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractOpticalEffect
from .base._contribution import Contribution
from .base._first_guess import fit_amplitude
from .base._random_walk import anew_in_each_run, narrow_band, random_walk
from .base._residual_summary import ResidualSummary


class Drift(AbstractOpticalEffect):
    r"""A slow exponential in the session's time: $\nu + A (1 - e^{-(t - t_0)/\tau})$ from $t_0$ on.

    `amplitude` is $A$, `tau` $\tau$ in s, `start` $t_0$ in s. With $\tau$ long beside the session
    it is the linear drift $A (t - t_0)/\tau$, and only $A/\tau$ is identifiable. It does not depend
    on the drive, so no periodic drive compensates it.

    Temperature moves a laser by some 30 GHz/K (MOGLabs CEL manual); drift: arXiv 2205.14149.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Drift
    >>> drift = Drift.at(amplitude=2.0, tau=60.0)  # GHz, s
    >>> drift(jnp.array([0.0, 60.0, 600.0]), jnp.zeros(3)).round(3).tolist()  # GHz
    [0.0, 1.264, 2.0]
    """

    name: ClassVar[str] = "drift"
    label: ClassVar[str] = "drift of the optical frequency"
    pointwise: ClassVar[bool] = True
    signature_axis: ClassVar = "session"
    free_of_drive: ClassVar[bool] = True
    remedy: ClassVar[str] = "Stabilise temperature and current; repeat the zero before each scan."
    amplitude: Float[Array, ""] = parameter(unit="{x}", default=0.0)  # A
    tau: Float[Array, ""] = parameter(unit="s", default=60.0, bounds=(1e-2, 1e6))
    start: Float[Array, ""] = parameter(unit="s", default=0.0, held=True)

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        since = jnp.maximum(t - self.start, 0.0)
        return nu - self.amplitude * jnp.expm1(-since / self.tau)

    def other_forms(self, here: Contribution) -> Iterable[Float[np.ndarray, "functions samples"]]:
        """A random walk in the session's time, and smoother curves, within the runs, too."""
        count = _walk_functions(here)
        return [here.scaled(random_walk(here.time, count, n)) for n in (1.0, 1.5, 2.0)]

    def rival_forms(self, here: Contribution) -> Iterator[Float[np.ndarray, "functions samples"]]:
        """What begins anew with each run, as warmth of the drive; and noise about one frequency."""
        for part in anew_in_each_run(here.time, here.run):  # and as much of the drift as is likely
            yield here.scaled(np.vstack([part, here.added]))
        lasts = float(np.ptp(here.time))
        if lasts > 0:
            highest = _walk_functions(here) / (2.0 * lasts)
            octaves = np.arange(np.log2(max(highest * lasts / THRESHOLDS.hunting_cycles, 1.0)))
            for hertz in THRESHOLDS.hunting_cycles / lasts * 2.0**octaves:
                yield here.scaled(narrow_band(here.time, hertz, highest))

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[Drift]":
        start = float(summary.time.min())
        session = max(summary.duration_s, 0.0)
        taus = np.unique(np.clip(session * np.array([0.1, 0.3, 1.0, 10.0]), 0.02, 5e5))
        sizes = [fit_amplitude(summary, -np.expm1(-(summary.time - start) / tau)) for tau in taus]
        return [
            cls.at(amplitude=a, tau=tau, start=start) for a, tau in zip(sizes, taus, strict=True)
        ]


def _walk_functions(here: Contribution) -> int:
    return min(THRESHOLDS.walk_functions * here.rates.size, THRESHOLDS.most_walk_functions)
