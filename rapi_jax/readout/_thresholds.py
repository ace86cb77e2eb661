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
    vanished_blocks: int = threshold(
        3, unit="blocks of four fringes", origin="a shorter stretch may be a turn of the laser"
    )
    vanished_span: float = threshold(
        0.25, unit="of the usual span", origin="fringes; dust and misalignment leave more of them"
    )
    vanished_lag: float = threshold(
        0.06, unit="periods", origin="by which a laser's turn may follow the drive's"
    )
    vanished_move: float = threshold(
        0.4, unit="of the usual move", origin="of the drive; a laser's slope halves after a turn"
    )


THRESHOLDS = ReadoutThresholds()
