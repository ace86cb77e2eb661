"""Numbers that decide what a recording is said to allow, with unit and origin."""

import dataclasses

from rapi_jax.internal import threshold


@dataclasses.dataclass(frozen=True)
class RecordingCheckThresholds:
    """Numbers that decide about what may be asked of a recording."""

    enough_periods: int = threshold(
        3, unit="periods", origin="two repeat; three also tell a first period from rest and a drift"
    )
    swings_apart: float = threshold(
        1.2, unit="factor", origin="as for scan rates; swings within it do not show their law"
    )


THRESHOLDS = RecordingCheckThresholds()
