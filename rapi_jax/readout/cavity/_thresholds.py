"""Numbers that decide what is a peak of the cavity."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class CavityThresholds:
    """Numbers that decide what is a peak of the cavity."""

    peak_half_window: float = threshold(
        0.6, unit="fringes", origin="on each side of a peak that its fit sees; set by trial"
    )
    least_order_error: float = threshold(
        0.006,
        unit="orders",
        origin="off a whole number that a turn between two peaks must make; set by trial",
    )
    most_order_error: float = threshold(
        0.05, unit="orders", origin="off a whole number that always counts as a turn; set by trial"
    )
    fringe_harmonics: int = threshold(
        4,
        unit="harmonics",
        origin="of the shape of a low-finesse fringe; the fifth is below the noise at 1 %",
    )


THRESHOLDS = CavityThresholds()
