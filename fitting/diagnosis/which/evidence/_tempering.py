"""How much less sure odds are than chi-square says: no effect is quite as its equation."""

import dataclasses
from collections.abc import Collection

from ._calibration import Calibration
from ._evidence import Evidence
from ._thresholds import THRESHOLDS


@dataclasses.dataclass(frozen=True)
class Tempering:
    """Differences of log evidence are divided by a temperature, and chi-square by a misfit.

    `misfit`: chi-square a line that the best hypothesis leaves: where the base misfits, its misfit
    acts as noise of that size on every comparison. `base`, `form`: the temperature, and what the
    excess at stake adds to it; see `Calibration`.
    """

    misfit: float = 1.0
    base: float = 1.0
    form: float = 0.0

    @classmethod
    def of(cls, evidence: Evidence, calibration: Calibration) -> "Tempering":
        """The tempering of a recording's evidence.

        Where noise is unknown, what was read off is an upper bound: the best hypothesis tells what
        there is.
        """
        best = min(evidence.hypotheses, key=lambda h: h.cost)
        least = 1.0 if evidence.noise_known else THRESHOLDS.least_unknown_noise
        misfit = max(least, best.synchronous / evidence.lines)
        return cls(misfit, calibration.temperature, calibration.form)

    def temperature(self, stake: float) -> float:
        """Of two hypotheses with so much excess at stake between them, in chi-square."""
        return self.base + self.form * stake


def excess_at_stake(one: Collection[str], other: Collection[str], evidence: Evidence) -> float:
    """The excess without the effects in which two hypotheses differ: what these explain.

    An effect's equation is good to a few hundredths of what it explains: two that differ by less
    are not told apart by any amount of data.
    """
    common = set(one) & set(other)
    found = evidence.hypotheses
    without = [h for h in found if set(h.effects) == common]
    return max(evidence.excess((without or found)[0]), 0.0)
