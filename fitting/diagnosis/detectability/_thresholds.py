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
        "the smallest size 21 were seen; half: sizes grow by 1.4, where they are linear",
    )
    guesses: int = threshold(
        8,
        unit="guesses of an effect",
        origin="set by trial; at least, evenly over all: the median of their sizes is said",
    )
    rounds: int = threshold(6, unit="rounds", origin="set by trial; of the search, at most")
    strongest: float = threshold(
        1e4,
        unit="times the first guess",
        origin="convention: what shows only when so strong is not seen in the recording; sizes of "
        "1e15 and more were told of effects that a recording cannot show",
    )
    accuracy: float = threshold(
        0.02, unit="of the size", origin="a fiftieth is less than the spread of noise"
    )
    slopes: tuple[float, float] = threshold(
        (0.5, 12.0),
        unit="decades of chi-square a decade of size",
        origin="set by trial; 2 is what is linear, and steps of the search stay within these",
    )


THRESHOLDS = DetectabilityThresholds()
