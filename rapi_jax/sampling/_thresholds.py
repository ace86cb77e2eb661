"""Numbers that decide where a sampled drive turns, and whether it repeats."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class SamplingThresholds:
    """Numbers that decide where a sampled drive turns, and whether it repeats."""

    row_multiple: int = threshold(
        256, unit="samples", origin="rows padded to a multiple share compiled code"
    )
    corner_samples: int = threshold(
        6,
        unit="samples",
        origin="set by trial; on either side, through which a straight line must go",
    )
    corner_straightness: float = threshold(
        5e-3, unit="of their rise", origin="set by trial; how far samples may lie off their line"
    )
    same_sample: float = threshold(
        1e-6, unit="steps", origin="rounding: a corner this near a sample is that sample"
    )
    period_edge: float = threshold(
        0.015,
        unit="periods",
        origin="set by trial; a period that starts this near the first sample starts with it",
    )
    whole_periods: float = threshold(
        0.02,
        unit="samples",
        origin="set by trial; how far periods may be from whole samples, over the whole run",
    )
    repeat_error: float = threshold(
        1e-9,
        unit="of the swing",
        origin="rounding: how far the drive of one period may be from that of the next",
    )
    near_sample: float = threshold(1e-6, unit="steps", origin="rounding of a time")
    most_turns: int = threshold(
        16, unit="turns a period", origin="more are those of a multisine, or of noise"
    )
    clock_change: float = threshold(
        0.25,
        unit="of a step",
        origin="convention; the step of an even clock stays within a quarter of the usual one",
    )
    clock_stretch: int = threshold(
        10, unit="steps", origin="convention; fewer equal steps are no sampling rate of their own"
    )
    clock_even: float = threshold(
        0.95,
        unit="of the steps",
        origin="convention; all but the steps where the rate changes are in even stretches",
    )


THRESHOLDS = SamplingThresholds()
