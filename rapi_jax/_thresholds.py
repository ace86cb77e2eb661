"""Numbers that decide limits of a drive and straightness of a scan."""

import dataclasses

from ._threshold import threshold


@dataclasses.dataclass(frozen=True)
class CoreThresholds:
    """Numbers that decide whether a drive is within its limits, and how straight a scan is."""

    limit_rounding: float = threshold(
        1e-9,
        unit="of the range",
        origin="rounding: two ways to compute one voltage must not differ in the verdict",
    )
    turn_near: float = threshold(
        0.015,
        unit="periods",
        origin="set by trial; the part on each side of a turn from which the turn is found",
    )
    turn_guard: float = threshold(
        0.002,
        unit="periods",
        origin="set by trial; left out next to the turn, where a device is still turning",
    )
    one_rate: float = threshold(
        1.2,
        unit="fastest over slowest scan rate",
        origin="set by trial; within it a lag and hysteresis look alike",
    )
    longest_beat: int = threshold(
        1 << 18, unit="samples", origin="memory: a longer beat is refused"
    )


THRESHOLDS = CoreThresholds()
