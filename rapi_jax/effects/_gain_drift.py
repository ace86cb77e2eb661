"""A gain that changes in the course of a session."""

from typing import ClassVar

import numpy as np
from jaxtyping import Array, Float

from .._parameter import parameter
from .._precision import float64
from ._base import AbstractOpticalEffect
from ._evidence import Evidence
from ._size import size


class GainDrift(AbstractOpticalEffect):
    r"""A gain straight in the session's time: $\nu + k (t - t_0)(\nu - \nu_c)$.

    `rate` is $k$, 1/s; `centre` $\nu_c$, the response about which the scan grows; `start` $t_0$, s.
    It does not look at the drive's past, which is what tells it from creep; no repeating drive
    undoes it. Typically 0.01 to 3 % in a session.
    """

    name: ClassVar[str] = "gain_drift"
    rate: Float[Array, ""] = parameter(unit="1/s", default=0.0, bounds=(-10.0, 10.0))  # k
    centre: Float[Array, ""] = parameter(unit="{x}", default=0.0, held=True)
    start: Float[Array, ""] = parameter(unit="s", default=0.0, held=True)

    @float64
    def __call__(
        self, t: Float[Array, " time"], nu: Float[Array, " time"]
    ) -> Float[Array, " time"]:
        return nu + self.rate * (t - self.start) * (nu - self.centre)

    @classmethod
    def trials(cls, evidence: Evidence) -> "list[GainDrift]":
        start = float(evidence.time.min())
        centre = float(evidence.response.min() + evidence.response.max()) / 2.0
        found = size(evidence, (evidence.time - start) * (evidence.response - centre))
        rates = np.clip([found, -found], -5.0, 5.0)
        return [cls.at(rate=rate, centre=centre, start=start) for rate in rates]
