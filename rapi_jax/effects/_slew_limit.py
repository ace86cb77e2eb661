"""A slew limit of the drive amplifier: its largest slope."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._errors import NotInvertible
from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractFollower, AbstractInvertible
from .base._effect import AbstractEffect
from .base._residual_summary import ResidualSummary


def _follow_step(value, one):
    """The output after one linear step of the drive, which it may catch up with within the step.

    And when it does so, s from the step's begin, with its value then.
    """
    limit, step, before, after = one
    slope = jnp.where(step > 0, (after - before) / jnp.where(step > 0, step, 1.0), 0.0)
    behind = before - value
    sign = jnp.sign(behind)
    closing = limit - sign * slope
    caught_s = jnp.where(closing > 0, sign * behind / jnp.where(closing > 0, closing, 1.0), jnp.inf)
    caught = caught_s <= step
    bend_s = jnp.where(caught, caught_s, step)
    bend = value + sign * limit * bend_s
    along = after + (jnp.clip(slope, -limit, limit) - slope) * (step - bend_s)
    value = jnp.where(caught, along, bend)
    return value, (value, bend_s, bend)


class SlewLimit(AbstractFollower, AbstractInvertible):
    r"""An output that follows the drive no faster than `limit`: $|\dot v| \le I / C$.

    $\dot v$ is $\dot u$ where the output has caught up and $|\dot u|$ allows, and $\pm$ `limit`
    towards the drive elsewhere. An amplifier of largest current $I$ on a piezo of capacitance $C$
    does this. It acts on the fastest record alone.

    Exact at any sampling for a piecewise linear drive.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import SlewLimit
    >>> time, drive = jnp.arange(4.0) * 0.001, jnp.array([0.0, 1.0, 2.0, 3.0])
    >>> SlewLimit.at(limit=500.0)(time, drive).round(3).tolist()  # V
    [0.0, 0.5, 1.0, 1.5]
    """

    limit: Float[Array, ""] = parameter(unit="{u}/s", default=jnp.inf, positive=True)

    name: ClassVar[str] = "slew_limit"
    label: ClassVar[str] = "a slew limit of the drive"
    signature_axis: ClassVar = "since_turn"
    remedy: ClassVar[str] = "Scan slower or less, or use an amplifier with more current."
    smooth: ClassVar = False

    @classmethod
    def onset(cls, summary: ResidualSummary) -> "SlewLimit":
        """At the slope of the fastest run."""
        fastest = _fastest(summary, 1.0)
        return cls.at(limit=fastest) if fastest > 0 else cls()

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """Limits just below, and well below, the slope of the fastest run.

        And just below the steepest part of a run that is not a triangle.
        """
        usual, steepest = (_fastest(summary, share) for share in THRESHOLDS.slew_quantiles)
        limits = [share * usual for share in (0.97, 0.9, 0.8, 0.65)]
        limits += [limit for limit in (0.97 * steepest, 0.93 * steepest) if limit > usual]
        return [cls.at(limit=limit) for limit in limits if limit > 0]

    def follow(
        self, t: Float[Array, " time"], u: Float[Array, " time"], start: Float[Array, ""]
    ) -> Float[Array, " time"]:
        return self.follow_between(t, u, start)[0]

    @float64
    def follow_between(
        self, t: Float[Array, " time"], u: Float[Array, " time"], start: Float[Array, ""]
    ) -> tuple[Float[Array, " time"], Float[Array, " steps"], Float[Array, " steps"]]:
        step = jnp.diff(t)
        limit = jnp.broadcast_to(jnp.minimum(self.limit, THRESHOLDS.no_slew_limit), step.shape)
        scanned = jax.lax.scan(_follow_step, start, (limit, step, u[:-1], u[1:]))[1]
        rest, bend_s, bend = scanned
        return jnp.concatenate([start[None], rest]), t[:-1] + bend_s, bend

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal itself, which must nowhere be steeper than the limit."""
        limit = float(self.limit)
        slope = np.abs(np.diff(np.asarray(signal), append=float(signal[0]))) / float(t[1] - t[0])
        if slope.max() > limit * (1 + 1e-9):
            at = int(slope.argmax())
            raise NotInvertible(
                f"the effect slew_limit passes at most {limit:.6g} V/s, but the drive that would "
                f"be needed rises by {slope[at]:.6g} V/s after sample {at}. Scan less, more slowly "
                "or with longer corners."
            )
        return signal


def _fastest(summary: ResidualSummary, share: float) -> float:
    """The slope that all but `share` of the steps of the fastest run fall short of, V/s."""
    fastest = 0.0
    for run in np.unique(summary.run):
        inside = summary.run == run
        step, rise = np.diff(summary.time[inside]), np.diff(summary.drive[inside])
        good = step > 0
        if good.any():
            fastest = max(fastest, float(np.quantile(np.abs(rise[good] / step[good]), share)))
    return fastest
