"""Numbers that decide how exactly a drive is computed, and when that is given up."""

import dataclasses

from rapi_jax._threshold import threshold


@dataclasses.dataclass(frozen=True)
class InversionThresholds:
    """Numbers that decide how exactly a drive is computed, and when that is given up."""

    mixed_iterations: int = threshold(
        12,
        unit="iterations",
        origin="set by trial; remembered by Anderson mixing, more of them are nearly dependent",
    )
    least_slope: float = threshold(
        1e-9, unit="of the mean slope", origin="below it a model is singular to rounding"
    )
    most_iterations: int = threshold(
        50, unit="iterations", origin="of compensation; set by trial, 5 to 20 are usual"
    )
    wrapped_samples: int = threshold(
        4, unit="samples", origin="of the next period, so that the last one has a neighbour"
    )
    target_error: float = threshold(
        1e-6,
        unit="of the span, rms",
        origin="a tenth of the straightest scan in the paper: the whole model must come as near",
    )
    coupling_change: float = threshold(
        1e-8,
        unit="of the swing",
        origin="far below what a scan must follow: a drive that changes less has converged",
    )
    inverse_error: float = threshold(
        1e-9,
        unit="of the span",
        origin="rounding of an operator and its inverse, with room: how well it is inverted",
    )
    swing_grid: int = threshold(
        257,
        unit="swings",
        origin="set by trial; peak-to-peak drives at which a first look is taken, more cost time",
    )
    minimum_grid: int = threshold(
        33,
        unit="drives",
        origin="set by trial; where a falling response at the minimum is looked for",
    )
    swing_crossings: int = threshold(
        4,
        unit="zeros",
        origin="set by trial; so many zeros between swings of the grid are looked into",
    )
    range_margin: float = threshold(
        0.05,
        unit="of the range",
        origin="a straight scan of the same span needs a little more drive",
    )
    least_swing: float = threshold(
        0.6,
        unit="of the least swing recorded",
        origin="set by trial; a measured piezo asked for 0.14 of it was missed by a factor of four",
    )
    slope_margin: float = threshold(
        3.0,
        unit="of the slope",
        origin="a straight scan turns twice as steeply as the triangle it was identified with",
    )
    effect_iterations: int = threshold(
        30, unit="iterations", origin="set by trial; of undoing one effect"
    )
    worse: float = threshold(
        1.5,
        unit="of the best nonlinearity",
        origin="set by trial; two iterations in a row above it end learning",
    )
    much_worse: float = threshold(
        4.0,
        unit="of the best nonlinearity",
        origin="set by trial; one iteration above it ends learning",
    )
    weak_response: float = threshold(
        0.1,
        unit="of the response at rest",
        origin="set by trial; below it the inverse grows no further",
    )
    least_local_slope: float = threshold(
        0.3,
        unit="of the mean slope",
        origin="set by trial; a smaller one would let noise near a turn into the drive",
    )
    interval_steps: int = threshold(
        20, unit="steps", origin="Newton inside one polynomial piece takes 2 to 5"
    )
    root_rounding: float = threshold(
        1e-15, unit="of the range", origin="rounding: a step no larger ends the search"
    )
    root_steps: int = threshold(
        200, unit="steps", origin="Newton takes 2 to 6, bisection alone at most 60 to the last bit"
    )


THRESHOLDS = InversionThresholds()
