"""Numbers that say when an effect counts as seen, and how its smallest size is looked for."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class DetectabilityThresholds:
    """The level, and the search for the size that reaches it."""

    level: float = threshold(0.95, unit="probability", origin="the files' contract")
    found: float = threshold(
        0.75,
        unit="of the noncentrality",
        origin="what searches find of it: without this, of 26 simulated devices with an effect of "
        "the smallest size 21 were seen, and 3 missed by less; half: sizes grow by 1.4",
    )
    guesses: int = threshold(
        8,
        unit="guesses of an effect",
        origin="looked at, evenly over all; the median of their sizes moves by under a tenth of "
        "itself with twice as many",
    )
    rounds: int = threshold(
        6, unit="rounds", origin="of the search; from a factor of 1000 off four are enough"
    )
    accuracy: float = threshold(
        0.02, unit="of the size", origin="a fiftieth is less than the spread of noise"
    )
    slopes: tuple[float, float] = threshold(
        (0.5, 12.0),
        unit="decades of chi-square a decade of size",
        origin="2 for what is linear, 4 to 6 for a drive that is cut; beyond lies rounding",
    )


THRESHOLDS = DetectabilityThresholds()
