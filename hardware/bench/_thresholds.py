"""Numbers that decide what is recorded and how long a bench waits."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class BenchThresholds:
    """Numbers that decide what is recorded and how long a bench waits."""

    margin_fraction: float = threshold(
        0.18,
        unit="periods",
        origin="most that is recorded on either side of a drive, so that turns at its ends are "
        "seen; set by trial",
    )
    trigger_wait_periods: float = threshold(
        2.0,
        unit="periods",
        origin="longest wait for a trigger: one comes each period, and one may be missed",
    )
    late_s: float = threshold(
        10.0,
        unit="s",
        origin="what a record may take beyond its own length and the wait for a trigger; set by "
        "trial",
    )
    watchdog_reserve_s: float = threshold(
        1.0,
        unit="s",
        origin="a record is taken only if it is there so long before a counted drive ends: "
        "more than a digitizer takes to say so; set by trial",
    )


THRESHOLDS = BenchThresholds()
