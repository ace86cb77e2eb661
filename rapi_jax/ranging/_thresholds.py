"""Numbers that decide what is said of a ranging result."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class RangingThresholds:
    """Numbers that decide what is said of a ranging result."""

    path_off: float = threshold(
        0.01,
        unit="1",
        origin="a fibre is known to some mm of 5 m; a wrong unit or index is 1 % or more",
    )
    fewest_for_scatter: int = threshold(
        7,
        unit="scans",
        origin="of one direction: four third differences, whose median is good to a factor of two",
    )
    fewest_scans: int = threshold(
        4, unit="scans", origin="two of each direction: two unknowns, and two to judge them by"
    )


THRESHOLDS = RangingThresholds()
