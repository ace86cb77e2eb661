"""Numbers that decide how a target is tracked."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class TrackingThresholds:
    """Numbers that decide how a target is tracked."""

    gate: float = threshold(
        1e-4,
        unit="probability",
        origin="that a good scan is gated; one in ten tracks of 1000 scans loses one",
    )
    outlier: float = threshold(
        1e-2, unit="probability", origin="of a scan that says nothing, before it is seen; by trial"
    )
    manoeuvre: float = threshold(
        1e-3, unit="probability", origin="of a change of velocity at a scan; a stage starts rarely"
    )
    jump: float = threshold(
        1e-8,
        unit="probability",
        origin="of another target at a scan; at 1e-5 two scans of a stage's ramp pass for one",
    )
    velocity_spread: float = threshold(
        0.1, unit="m/s", origin="change of velocity in a manoeuvre; twice the paper's fastest stage"
    )
    distance_spread: float = threshold(
        0.3,
        unit="m",
        origin="change of distance in a jump; beyond 1e4 sigma the smoother loses digits",
    )
    acceleration_spread: float = threshold(
        1.0, unit="m/s^2", origin="of a laboratory stage as it starts; for order 2 alone"
    )
    fastest: float = threshold(
        0.5, unit="m/s", origin="standard deviation of the first velocity; ten times the paper's"
    )
    shortest_stretch: int = threshold(
        4, unit="scans", origin="between changes; two unknowns and two scans that check them"
    )
    hypotheses: int = threshold(
        16, unit="1", origin="kept after each scan; four scans of both signs, as they begin"
    )
    memory: int = threshold(
        4, unit="scans", origin="hypotheses alike over these are one; two pairs of up and down"
    )
    range_errors: float = threshold(
        5.0, unit="standard errors", origin="by which a distance may lie outside its range"
    )
    same_state: float = threshold(
        5.0, unit="standard errors", origin="within which two hypotheses are the same track"
    )
    ambiguous_odds: float = threshold(
        20.0, unit="odds", origin="below these a track is called ambiguous; 95 % to 5 %"
    )
    fold_odds: float = threshold(
        100.0, unit="odds", origin="of a scan's sign, below which the scan is left out"
    )
    scale_likelihood: float = threshold(
        2.7,
        unit="log likelihood",
        origin="gain for which errors are scaled; one-sided test at 1 % (chi-square 5.41 / 2)",
    )
    largest_scale: float = threshold(
        3.0,
        unit="stated errors",
        origin="beyond which scatter is called vibration; likelihood cannot tell the two apart",
    )
    inflation: float = threshold(
        1e6,
        unit="variances",
        origin="of the first state over what all scans say of it; adds 1e-6 of their information",
    )
    finest: float = threshold(
        4e-14,
        unit="of the prior's variance",
        origin="errors of scans beside it: 200 times the rounding of float64; 0.8 um beside 4 m",
    )
    shortest_padding: int = threshold(
        64, unit="scans", origin="programs are compiled for this length and its doubles"
    )


THRESHOLDS = TrackingThresholds()
