"""Numbers that decide how plays are evaluated."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class PlaysThresholds:
    """Numbers that decide how plays are evaluated; the outputs do not depend on them."""

    samples_a_turn: int = threshold(
        8,
        unit="samples",
        origin="measured; with fewer between two turns a recursion over samples is as fast",
    )
    least_turns: int = threshold(
        8,
        unit="turns",
        origin="two periods of a triangle and their ends; drives with fewer share compiled code",
    )


THRESHOLDS = PlaysThresholds()
