"""The ends of the amplifier's range."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from .._parameter import parameter
from .._precision import float64
from ._base import AbstractDriveEffect, AbstractEffect, AbstractInvertible
from ._evidence import Evidence
from ._lags import not_invertible


class Saturation(AbstractDriveEffect, AbstractInvertible):
    r"""A drive that is cut off: $\min(\max(u, u_\mathrm{low}), u_\mathrm{high})$.

    An amplifier at its supply rail clips the last percent of a scan, at one end or at both.
    """

    low: Float[Array, ""] = parameter(unit="{u}", default=-jnp.inf)
    high: Float[Array, ""] = parameter(unit="{u}", default=jnp.inf)

    name: ClassVar = "saturation"

    @classmethod
    def trials(cls, evidence: Evidence) -> list[AbstractEffect]:
        """Each end cut by 1 and by 4 % of the drive's range, and both by 2 %."""
        low, high = float(evidence.drive.min()), float(evidence.drive.max())
        swing = high - low
        if not swing > 0:
            return []
        cuts = [(0.01, -1.0), (0.04, -1.0), (-1.0, 0.01), (-1.0, 0.04), (0.02, 0.02)]
        return [cls.at(low=low + below * swing, high=high - above * swing) for below, above in cuts]

    @float64
    def __call__(self, t: Float[Array, " time"], u: Float[Array, " time"]) -> Float[Array, " time"]:
        del t
        return jnp.clip(u, self.low, self.high)

    @float64
    def inverse(
        self, t: Float[Array, " time"], signal: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        """The signal itself, which must nowhere lie beyond the ends."""
        del t
        value, low, high = np.asarray(signal), float(self.low), float(self.high)
        slack = 1e-9 * float(np.ptp(value))
        if value.min() < low - slack or value.max() > high + slack:
            raise not_invertible(
                f"the effect saturation passes {low:.6g} to {high:.6g} V, but the scan needs "
                f"{value.min():.6g} to {value.max():.6g} V behind it. Scan less, or move the bias."
            )
        return signal
