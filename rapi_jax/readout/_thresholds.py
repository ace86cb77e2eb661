"""Numbers that decide how the phase of a record is followed."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class ReadoutThresholds:
    """Numbers that decide how the phase of a record is followed."""

    samples_per_fringe: float = threshold(
        16.0,
        unit="samples",
        origin="kept in the fastest fringe; a mean over a group then loses 0.6 % of the visibility",
    )
    slope_ratio: float = threshold(
        2.5,
        unit="times the drive",
        origin="how much steeper than its drive a response may be in places; set by trial",
    )
    nodes_per_fringe: float = threshold(
        6.0, unit="nodes", origin="of the correction to the phase; set by trial"
    )
    envelope_error: float = threshold(
        2e-3, unit="amplitudes", origin="how well visibility and background are known; set by trial"
    )
    turn_inner: float = threshold(
        2.5, unit="fringes", origin="nearer to a turn its own model alone is used; set by trial"
    )
    turn_outer: float = threshold(
        5.0,
        unit="fringes",
        origin="farther from a turn the analytic signal alone is used; set by trial",
    )


THRESHOLDS = ReadoutThresholds()
