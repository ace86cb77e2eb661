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
    commanded: float = threshold(
        0.01,
        unit="of the span, rms",
        origin="as `commanded` of an import: a response of the paper's device departs from a "
        "triangle by 4 %; 0.005: noise of 0.5 % hides a swap, 0.02: nearly straight devices too",
    )
    unsettled_level: float = threshold(
        0.01,
        unit="recordings",
        origin="convention: one settled recording in 100 is told to be unsettled; halved and "
        "doubled, so is that share",
    )
    unsettled_terms: int = threshold(
        16,
        unit="terms of a cosine transform",
        origin="a settling is smooth over a period; 8: one that ends in less than a 16th of it is "
        "seen later, 32: more noise is compared, and a slow one is seen later",
    )
    unsettled_least: float = threshold(
        1e-6,
        unit="of the response's span, as noise of each term",
        origin="readings printed in six digits; a tenth: interpolation between samples is seen in "
        "simulated readings without noise, ten times: noise of an excellent reading",
    )


THRESHOLDS = RecordingCheckThresholds()
