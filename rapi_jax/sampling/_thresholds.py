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
    corner_sharpness: float = threshold(
        4.0,
        unit="of the changes of slope in the steps on either side",
        origin="on a smooth curve the change over two steps is as large as those beside it "
        "together: 1. Halved or doubled, the same corners of zigzags are found",
    )
    corner_angle: float = threshold(
        60.0,
        unit="of how far samples lie off their lines",
        origin="by how much the lines' rises differ: on a smooth curve 18 times as much. Halved or "
        "doubled, the same corners of zigzags are found",
    )
    corner_change: float = threshold(
        1e-4,
        unit="of the steepest step",
        origin="a smaller change of slope moves nothing that is measured",
    )
    corner_rounding: float = threshold(
        1e-9, unit="of the rise beside it", origin="rounding: how far a level line may be off"
    )
    smooth_nodes: int = threshold(
        400,
        unit="nodes a period",
        origin="5 effects on sines of 60 samples a period: at worst 5 MHz of 5 GHz are missed, "
        "halved 16, doubled 1.3; with the samples alone 181",
    )
    straight_nodes: int = threshold(
        300,
        unit="nodes a period",
        origin="the same on triangles and trapezoids: at worst 1.5 MHz, halved 4.0, doubled 0.5",
    )
    straight_bend: float = threshold(
        1e-5,
        unit="of the swing a step, second differences",
        origin="a straight line misses an eighth of it, 0.1 MHz of 75 GHz; a drive in a table of "
        "six digits has 1e-6",
    )
    spline_margin: int = threshold(
        24, unit="samples", origin="an end's influence on a cubic spline falls by 3.7 a knot"
    )
    spline_knots: int = threshold(
        6, unit="knots", origin="with fewer nothing tells that it is smooth"
    )
    smooth_differences: float = threshold(
        0.5,
        unit="fourth differences, of the second ones, rms",
        origin="a sine of 9 samples a period has 0.47, noise 3.4, the root of 70 / 6",
    )
    same_node: float = threshold(1e-3, unit="steps", origin="nodes nearer to another add nothing")
    same_sample: float = threshold(
        1e-6, unit="steps", origin="rounding: a corner this near a sample is that sample"
    )
    turn_rises: tuple[float, ...] = threshold(
        (0.1, 0.2, 0.4, 0.7),
        unit="of the swing",
        origin="set by trial: of the samples about a turn those are fitted that rise by less, the "
        "first with samples enough. Halved, noise moves a sine's turn by 3 times as much; doubled, "
        "a quartic misses a sine's turn by more",
    )
    turn_samples: int = threshold(
        6,
        unit="samples",
        origin="twice what a parabola needs, on either side of a turn. Halved, noise moves turns "
        "at 50 samples a period by more; doubled, they are known to a bin there",
    )
    lowest_bin: tuple[float, ...] = threshold(
        (2.5, 1.5),
        unit="bins",
        origin="how far the lowest bin of a mean over three may be from the turn, of a flyback and "
        "of a triangle; the first is used where samples are enough. Halved, flybacks of a tenth of "
        "a period may be misplaced by a bin; doubled, so are turns at 50 samples a period",
    )
    turn_slope: float = threshold(
        1.0,
        unit="swings a period",
        origin="a corner changes the slope by more, a triangle's by at least 4, a sine by nothing. "
        "Halved or doubled, neither is taken for the other",
    )
    turn_guard: float = threshold(
        0.002,
        unit="periods",
        origin="that of `Linearity`: left out next to a turn, where a device is still turning. "
        "Halved or doubled, corners between straight sides stay where they are",
    )
    turn_passes: int = threshold(
        5, unit="passes", origin="each begins where the last one ended; two are enough for a corner"
    )
    turn_rounding: float = threshold(
        1e-7,
        unit="of the swing",
        origin="residuals below are rounding and tell no curve from another",
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
