"""Feed-through of the piezo's drive into the diode's current."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractCouplingEffect
from .base._first_guess import fit_amplitude
from .base._first_order_lags import respond_from_rest
from .base._linear import Modes
from .base._residual_summary import ResidualSummary


class CurrentCoupling(AbstractCouplingEffect):
    r"""Capacitive feed-through: $\nu + k\,L[\dot u]$, $u$ the drive that is sent.

    `coupling` is $k$, of either sign; $L$ a first-order lag by `lag_s`, where the current's own
    driver rounds it (below some 30 us it counts as none). The drive is piecewise linear between
    samples: within a piece $\dot u$ is its slope, at a corner the mean of both sides. (A part
    proportional to $u$ is not identifiable beside the operator's gain.) Noise of a recorded drive
    is differentiated too: use the drive that was requested, not the one read back.

    Diode current moves a laser by some 3 MHz/uA (MOGLabs CEL manual); arXiv 1712.06627.

    >>> import equinox as eqx
    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import CurrentCoupling
    >>> time, drive = jnp.arange(4.0) * 0.01, jnp.array([0.0, 1.0, 2.0, 3.0])  # 100 V/s
    >>> coupling = eqx.filter_jit(CurrentCoupling.at(coupling=0.002))  # compiled whole
    >>> coupling(time, 0.0 * drive, drive).round(3).tolist()  # GHz
    [0.2, 0.2, 0.2, 0.2]
    """

    name: ClassVar[str] = "current_coupling"
    label: ClassVar[str] = "coupling of the drive into the diode current"
    pointwise: ClassVar[bool] = True
    signature_axis: ClassVar = "since_turn"
    remedy: ClassVar[str] = (
        "Compensate with the corrected model; look at the current driver's ground."
    )
    steady: ClassVar[bool] = True
    coupling: Float[Array, ""] = parameter(unit="{x} s/{u}", default=0.0)  # k
    lag_s: Float[Array, ""] = parameter(unit="s", default=0.0, bounds=(0.0, 0.02))

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"], u: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        lag = jnp.maximum(self.lag_s, THRESHOLDS.coupling_least_lag)
        behind = (u - respond_from_rest(Modes(lag[None], jnp.ones(1)), t, u)) / lag
        # A sample on a corner sees one side as soon as there is a lag, and both without.
        sudden = jnp.exp(-self.lag_s / THRESHOLDS.coupling_sudden_lag)
        return nu + self.coupling * (sudden * mean_slopes(t, u) + (1.0 - sudden) * behind)

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[CurrentCoupling]":
        slope = np.zeros(summary.time.size)
        for k in np.unique(summary.run):
            mine = np.flatnonzero(summary.run == k)
            if mine.size > 1:
                slope[mine] = _compiled_slopes(summary.time[mine], summary.drive[mine])
        found = fit_amplitude(summary, slope)
        return [
            cls.at(coupling=k, lag_s=0.1 * THRESHOLDS.coupling_least_lag) for k in (found, -found)
        ]


@float64
def _compiled_slopes(t: np.ndarray, u: np.ndarray) -> np.ndarray:
    """`mean_slopes`, compiled once for similar lengths: a repeated sample adds no slope."""
    more = (0, -t.size % THRESHOLDS.slopes_bucket)
    return np.asarray(jax.jit(mean_slopes)(np.pad(t, more, "edge"), np.pad(u, more, "edge")))[
        : t.size
    ]


def mean_slopes(t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
    """Mean of the slopes before and after each sample; a repeated sample has no side."""
    step = jnp.diff(t)
    moves = step > 0
    slope = jnp.where(moves, jnp.diff(u) / jnp.where(moves, step, 1.0), 0.0)
    none = jnp.zeros(1)
    total = jnp.concatenate([none, slope]) + jnp.concatenate([slope, none])
    sides = moves.astype(u.dtype)
    count = jnp.concatenate([none, sides]) + jnp.concatenate([sides, none])
    return total / jnp.maximum(count, 1.0)
