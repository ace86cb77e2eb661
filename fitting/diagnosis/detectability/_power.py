r"""How much chi-square an effect must take away to be named, and how surely it does.

An effect that adds $s$ to the whitened errors, beyond what the flexible base absorbs, lowers
chi-square by a noncentral $\chi^2_k(\lambda)$, $\lambda = s's$, in a refit of its $k$ parameters.
"""

import dataclasses

import numpy as np
from scipy.special import chndtrinc

from fitting.diagnosis.which._thresholds import THRESHOLDS as WHICH
from fitting.diagnosis.which.evidence._calibration import Calibration

from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class Demand:
    """The noncentralities from which an effect is named with `THRESHOLDS.level`.

    - `either`: of all errors, in units of what noise and base misfit leave; a search finds a part.
    - `synchronous`, `nonsynchronous`: one of which must be reached besides, in units of noise; 0
      where none is. `misfit`: what noise and base misfit leave of each, a line.
    """

    either: float
    synchronous: float
    nonsynchronous: float
    misfit: tuple[float, float]

    @classmethod
    def of(
        cls,
        left: tuple[float, float],
        sizes: tuple[int, int],
        calibration: Calibration,
        *,
        parameters: int,
        explained: float | None = None,
        by_density: float = 0.0,
        law: bool = False,
    ) -> "Demand":
        """Beside the likeliest hypothesis, for an effect of so many `parameters`.

        `left`, `sizes`: chi-square that it leaves on the flexible base, and the number of errors,
        synchronous and not. `explained`: what its effects take away; `None` where it has none. A
        further one is looked for only where too much is left, and must take away more.
        `by_density`: what a density of plays explains beside the operator, and an effect might.
        `law`: whether it changes the law of thresholds.
        """
        misfit = (max(1.0, left[0] / max(sizes[0], 1)), max(1.0, left[1] / max(sizes[1], 1)))
        named = calibration.parameter * np.log(sum(sizes)) * parameters + 2.0 * calibration.chance
        named += 2.0 * calibration.law * law
        named += calibration.hysteresis * max(by_density, 0.0) / misfit[0]
        named += calibration.second * max(explained or 0.0, 0.0) / misfit[0]
        fall = max(float(named), WHICH.chance_fall)
        there = float(chndtrinc(fall, parameters, 1.0 - THRESHOLDS.level))
        either = there / THRESHOLDS.found
        if explained is None:
            return cls(either, 0.0, 0.0, misfit)
        shares = (
            (WHICH.explained_synchronous, WHICH.explained_synchronous_sigmas),
            (WHICH.explained_nonsynchronous, WHICH.explained_nonsynchronous_sigmas),
        )
        more = [
            share * n + (sigmas + _ONE_SIDED) * np.sqrt(2.0 * n) - x if n else np.inf
            for (share, sigmas), n, x in zip(shares, sizes, left, strict=True)
        ]
        synchronous, nonsynchronous = (float(max(x, 0.0)) for x in more)
        return cls(either, synchronous, nonsynchronous, misfit)

    def share(self, synchronous: float, nonsynchronous: float) -> float:
        """Of what is demanded, by an effect of these noncentralities; 1 or more is enough."""
        a, b = self.misfit
        named = (synchronous / a + nonsynchronous / b) / self.either
        parts = ((synchronous, self.synchronous), (nonsynchronous, self.nonsynchronous))
        looked = max(x / limit if limit > 0 else np.inf for x, limit in parts)
        return float(min(named, looked))


_ONE_SIDED = 1.645  # standard deviations: 95 % lie below
