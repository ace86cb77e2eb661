"""Saturation of the drive at the ends of the amplifier's range."""

from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax._errors import NotInvertible
from rapi_jax._parameter import parameter
from rapi_jax._precision import float64

from ._thresholds import THRESHOLDS
from .base._by_place import AbstractBend, AbstractInvertible
from .base._effect import AbstractEffect
from .base._residual_summary import ResidualSummary


class Saturation(AbstractBend, AbstractInvertible):
    r"""A drive that is cut off: $\min(\max(u, u_\mathrm{low}), u_\mathrm{high})$.

    An amplifier at its supply rail clips the last percent of a scan, at one end or at both. `knee`
    ($k$, V) makes the corner soft, $u - k \ln(1 + e^{(u - u_\mathrm{high})/k})$, likewise below.

    >>> import jax.numpy as jnp
    >>> from rapi_jax.effects import Saturation
    >>> time, drive = jnp.arange(4.0) * 0.001, jnp.array([0.0, 1.0, 2.0, 3.0])
    >>> Saturation.at(high=2.0)(time, drive).round(3).tolist()  # V
    [0.0, 1.0, 2.0, 2.0]
    """

    low: Float[Array, ""] = parameter(unit="{u}", default=-jnp.inf)
    high: Float[Array, ""] = parameter(unit="{u}", default=jnp.inf)
    knee: Float[Array, ""] = parameter(unit="{u}", default=0.0, bounds=(0.0, np.inf))

    name: ClassVar[str] = "saturation"
    label: ClassVar[str] = "saturation of the drive"
    signature_axis: ClassVar = "drive"
    remedy: ClassVar[str] = "Scan less, or move the bias away from the amplifier's end."
    strength: ClassVar = ("high", "low", "knee")

    @classmethod
    def onset(cls, summary: ResidualSummary) -> "Saturation":
        """Ends at those of the drive."""
        return cls.at(low=float(summary.drive.min()), high=float(summary.drive.max()))

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> list[AbstractEffect]:
        """Each end cut by 1 and by 4 % of the drive's range, sharp and soft; both by 2 %, soft."""
        low, high = float(summary.drive.min()), float(summary.drive.max())
        swing = high - low
        if not swing > 0:
            return []
        knee = THRESHOLDS.start_knee * swing
        ends = [(0.01, -1.0), (0.04, -1.0), (-1.0, 0.01), (-1.0, 0.04)]
        guesses = [(*cut, knee) for cut in (*ends, (0.02, 0.02))] + [(*cut, 0.0) for cut in ends]
        return [
            cls.at(low=low + below * swing, high=high - above * swing, knee=soft)
            for below, above, soft in guesses
        ]

    def kind(self) -> str:
        """Sharp or soft: next to no scan tells a knee of a sample's step from a lower end."""
        return "soft" if float(self.knee) > 0 else "sharp"

    @float64
    def between(
        self, t: Float[Array, " time"], u: Float[Array, " time"]
    ) -> tuple[Float[Array, " time"], Float[Array, " steps"], Float[Array, " steps"]]:
        """The drive that is cut off; it bends where it reaches an end, else in the middle."""
        start, rise = u[:-1], jnp.diff(u)
        part = jnp.full(rise.shape, 0.5)
        for end in (self.low, self.high):
            ahead = jnp.where(jnp.isfinite(end), end, start) - start
            crossed = (ahead * rise > 0) & (jnp.abs(ahead) < jnp.abs(rise))
            part = jnp.where(crossed, ahead / jnp.where(crossed, rise, 1.0), part)
        return self._cut(u), t[:-1] + part * jnp.diff(t), self._cut(start + part * rise)

    def _cut(self, u: Float[Array, " values"]) -> Float[Array, " values"]:
        soft = self.knee > 0
        knee = jnp.where(soft, self.knee, 1.0)

        def over(beyond):
            """The part of the drive that the rail cuts off; `beyond`: drive less rail."""
            inside = jnp.isfinite(beyond)
            some = jnp.where(inside, beyond, 0.0)
            cut = jnp.where(soft, knee * jax.nn.softplus(some / knee), jnp.maximum(some, 0.0))
            return jnp.where(inside, cut, 0.0)

        u = u - over(u - self.high)
        return u + over(self.low - u)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal itself, raised within a knee; it must nowhere lie beyond the ends."""
        del t
        value, low, high = np.asarray(signal), float(self.low), float(self.high)
        slack = 1e-9 * float(np.ptp(value))
        if value.min() < low - slack or value.max() > high + slack:
            raise NotInvertible(
                f"the effect saturation passes {low:.6g} to {high:.6g} V, but the scan needs "
                f"{value.min():.6g} to {value.max():.6g} V behind it. Scan less, or move the bias."
            )
        knee = float(self.knee)
        if not knee > 0:
            return signal
        for sign, end in ((-1.0, low), (1.0, high)):
            room = sign * (end - value) / knee
            if np.isfinite(end) and not room.min() > THRESHOLDS.least_room:
                raise NotInvertible(
                    f"the effect saturation reaches {end:.6g} V only with an endless drive, and "
                    f"the scan needs {value.min():.6g} to {value.max():.6g} V behind it. Scan "
                    "less, or move the bias."
                )
            # Far from the end nothing is taken off, and the exponential would overflow.
            near = room < THRESHOLDS.knee_reach
            some = np.where(near, room, 1.0)
            value = np.where(near, end - sign * knee * np.log(np.expm1(some)), value)
        return jnp.asarray(value)
