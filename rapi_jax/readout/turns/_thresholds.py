"""Numbers that decide where the laser turned."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class TurnThresholds:
    """Numbers that decide where the laser turned."""

    reach: float = threshold(
        8.0, unit="fringes", origin="on each side that a turn is fitted to; set by trial"
    )
    coarse_tolerance: float = threshold(
        1e-4, unit="1", origin="relative fall of the cost that ends a trial fit"
    )
    final_tolerance: float = threshold(
        1e-9, unit="1", origin="relative fall of the cost that ends the last fit"
    )
    least_log_rounding: float = threshold(
        -8.0,
        unit="log of the unit of time",
        origin="a rounding of 3e-4 of a fringe cannot be told from a corner",
    )
    most_log_rounding: float = threshold(
        5.0, unit="log of the unit of time", origin="longer than any window"
    )
    dense_half_width: float = threshold(
        2.0, unit="fringes", origin="of the dense knots about a turn; set by trial"
    )
    wide_half_width: float = threshold(
        8.0, unit="fringes", origin="of the wide knots about a turn; set by trial"
    )
    dense_spacing: float = threshold(
        0.5, unit="fringes", origin="between dense knots; set by trial"
    )
    wide_spacing: float = threshold(1.5, unit="fringes", origin="between wide knots; set by trial")
    spline_shape_error: float = threshold(
        0.006,
        unit="rad a knot",
        origin="misfit of the spline at a rounded corner, seen on lags of 20 us to 1 ms",
    )
    latest_share: float = threshold(
        0.35, unit="of a branch", origin="a laser turns at most so long after its drive"
    )
    latest_s: float = threshold(
        8e-3, unit="s", origin="a laser turns at most so long after its drive"
    )
    earliest_share: float = threshold(
        0.02, unit="of a branch", origin="a laser turns at most so long before its drive"
    )
    earliest_s: float = threshold(
        1e-4, unit="s", origin="a laser turns at most so long before its drive"
    )
    wide_peak: float = threshold(
        1.8,
        unit="usual widths",
        origin="a cavity peak wider than that has a turn of the laser in it; set by trial",
    )
    edge_evidence: float = threshold(
        3.0,
        unit="times",
        origin="by which a turn at the end of a record must explain more than none; set by trial",
    )
    inner_edge: float = threshold(
        4.0, unit="fringes", origin="from a record's end: what a turn's fit needs; set by trial"
    )
    turn_scatter: float = threshold(
        2.0, unit="fringes", origin="by which turns are late by more or less; set by trial"
    )
    visible_evidence: float = threshold(
        1.1,
        unit="times",
        origin="by which a turn must explain more than none to be seen: 1.00 to 1.04 where it is "
        "at the extreme of a fringe, 1.16 or more from 0.01 of a fringe beside it; noise of up to "
        "a tenth of the fringes",
    )


THRESHOLDS = TurnThresholds()
